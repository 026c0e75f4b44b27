// A fuzzer's input as numbers and pieces, or as a file.
#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "fuzz/target.h"

namespace walker::fuzz {

/// Past the end, numbers are 0 and pieces empty.
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

/// A file in memory, for functions that take a path.
class MemoryFile {
 public:
  MemoryFile(const std::uint8_t* data, std::size_t size)
      : descriptor_(memfd_create("walker_sim_fuzz", MFD_CLOEXEC)) {
    require(descriptor_ >= 0, "there is a file in memory");
    require(write(descriptor_, data, size) == static_cast<ssize_t>(size),
            "it takes what is written");
  }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  ~MemoryFile() { close(descriptor_); }

  std::string path() const { return "/proc/self/fd/" + std::to_string(descriptor_); }

 private:
  int descriptor_;
};

}  // namespace walker::fuzz
