// Splits a fuzzer's input into numbers and pieces; past its end, numbers are 0 and pieces empty.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

namespace walker::fuzz {

class Input {
 public:
  Input(const std::uint8_t* data, std::size_t size) : next_(data), end_(data + size) {}

  const std::uint8_t* next() const { return next_; }
  std::size_t size() const { return static_cast<std::size_t>(end_ - next_); }

  template <typename Number>
  Number number() {
    Number value = 0;
    const std::size_t width = std::min(size(), sizeof value);
    if (width != 0) std::memcpy(&value, next_, width);
    next_ += width;
    return value;
  }

  /// Reads a uint16 length, then that many bytes or as many as remain.
  std::vector<std::uint8_t> piece() {
    const std::size_t told = number<std::uint16_t>();
    const std::size_t length = std::min(told, size());
    std::vector<std::uint8_t> taken(next_, next_ + length);
    next_ += length;
    return taken;
  }

  std::string rest() {
    std::string text(next_, end_);
    next_ = end_;
    return text;
  }

 private:
  const std::uint8_t* next_;
  const std::uint8_t* end_;
};

}  // namespace walker::fuzz
