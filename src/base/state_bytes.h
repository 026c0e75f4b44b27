// A saved state as bytes: fields one after the other, as this processor has them.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

namespace walker {

/// What every complaint about bytes that cannot be a state begins with.
inline constexpr const char* kDamagedState = "the state is damaged: ";

[[noreturn]] inline void refuse_state(const std::string& what) {
  throw std::invalid_argument(kDamagedState + what);
}

/// FNV-1a over words of eight bytes, the last one padded with zeros. Each round is invertible, so
/// that a change within one word always changes the sum.
inline std::uint64_t checksum(const std::byte* bytes, std::size_t size) {
  constexpr std::uint64_t kBasis = 0xcbf29ce484222325;
  constexpr std::uint64_t kPrime = 0x100000001b3;
  std::uint64_t sum = kBasis ^ size;
  while (size != 0) {
    std::uint64_t word = 0;
    const std::size_t width = std::min(size, sizeof word);
    std::memcpy(&word, bytes, width);
    sum = (sum ^ word) * kPrime;
    bytes += width;
    size -= width;
  }
  return sum;
}

/// Appends fields.
class StateWriter {
 public:
  explicit StateWriter(std::vector<std::byte>& bytes) : bytes_(bytes) {}

  template <typename Number>
  void number(Number value) {
    numbers(&value, 1);
  }

  /// Also structs without gaps, whose bytes are all told.
  template <typename Number>
  void numbers(const Number* values, std::size_t count) {
    static_assert(std::is_trivially_copyable_v<Number> && !std::is_pointer_v<Number>);
    const auto* const begin = reinterpret_cast<const std::byte*>(values);
    bytes_.insert(bytes_.end(), begin, begin + count * sizeof(Number));
  }

  void text(const std::string& value) {
    number(static_cast<std::uint32_t>(value.size()));
    numbers(value.data(), value.size());
  }

 private:
  std::vector<std::byte>& bytes_;
};

/// Takes fields off. Throws std::invalid_argument where the bytes end before them.
class StateReader {
 public:
  StateReader(const std::byte* bytes, std::size_t size) : next_(bytes), end_(bytes + size) {}

  const std::byte* next() const { return next_; }
  std::size_t size() const { return static_cast<std::size_t>(end_ - next_); }

  template <typename Number>
  Number number() {
    static_assert(!std::is_same_v<Number, bool>, "flag() checks what it reads");
    Number value;
    numbers(&value, 1);
    return value;
  }

  template <typename Number>
  void numbers(Number* values, std::size_t count) {
    static_assert(std::is_trivially_copyable_v<Number> && !std::is_pointer_v<Number>);
    require(count, sizeof(Number));
    // GCC 10 takes a type with initial values for one that must not be copied so.
    if (count != 0) std::memcpy(static_cast<void*>(values), next_, count * sizeof(Number));
    next_ += count * sizeof(Number);
  }

  bool flag() {
    const auto value = number<std::uint8_t>();
    if (value > 1) refuse_state("a flag is " + std::to_string(value) + "; must be 0 or 1");
    return value == 1;
  }

  std::string text() {
    const auto size = number<std::uint32_t>();
    require(size, 1);
    std::string value(reinterpret_cast<const char*>(next_), size);
    next_ += size;
    return value;
  }

  /// A number of things that follow, before memory for them is asked for.
  /// @param bytes_each at least
  std::uint32_t count(std::size_t bytes_each) {
    const auto value = number<std::uint32_t>();
    require(value, bytes_each);
    return value;
  }

  void finish() const {
    if (next_ != end_) refuse_state(std::to_string(size()) + " bytes too many");
  }

 private:
  void require(std::size_t count, std::size_t bytes_each) const {
    if (count > size() / bytes_each) refuse_state("it ends within a field");
  }

  const std::byte* next_;
  const std::byte* end_;
};

}  // namespace walker
