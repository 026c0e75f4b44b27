// Serialization of saved states: consecutive fields in the processor's representation.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

#include "base/random.h"
#include "base/shortest_text.h"

namespace walker {

/// Prefix of the error messages about malformed states.
inline constexpr const char* kDamagedState = "the state is damaged: ";

[[noreturn]] inline void refuse_state(const std::string& what) {
  throw std::invalid_argument(kDamagedState + what);
}

/// FNV-1a over 8-byte words, the last one zero-padded. Each round is invertible, so a change within
/// one word always changes the sum.
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

class StateWriter {
 public:
  explicit StateWriter(std::vector<std::byte>& bytes) : bytes_(bytes) {}

  template <typename Number>
  void number(Number value) {
    numbers(&value, 1);
  }

  /// Also accepts structs without padding, whose bytes are all determinate.
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

/// Reads fields from a state. Throws std::invalid_argument if the state ends within a field.
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
    // The cast avoids GCC 10's -Wclass-memaccess for types with default member initializers.
    if (count != 0) std::memcpy(static_cast<void*>(values), next_, count * sizeof(Number));
    next_ += count * sizeof(Number);
  }

  /// As `numbers`. Rejects non-finite values and those of greater magnitude than the limit.
  /// @param what name of the values in the error message
  template <typename Number>
  void finite_numbers(Number* values, std::size_t count, const char* what,
                      Number limit = std::numeric_limits<Number>::max()) {
    numbers(values, count);
    const auto is_within = [limit](Number value) { return std::abs(value) <= limit; };
    if (std::all_of(values, values + count, is_within)) return;
    refuse_state(std::string(what) + " must be finite" +
                 (limit < std::numeric_limits<Number>::max()
                      ? ", and at most " + shortest_text(double{limit})
                      : ""));
  }

  template <typename Number>
  Number finite_number(const char* what, Number limit = std::numeric_limits<Number>::max()) {
    Number value;
    finite_numbers(&value, 1, what, limit);
    return value;
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

  /// Reads the number of elements that follow. Checks it against the remaining bytes, so that a
  /// caller can allocate memory for them.
  /// @param bytes_each minimum size of an element
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

inline void write_generator(const Generator& generator, StateWriter& writer) {
  const GeneratorState state = generator.state();
  writer.numbers(state.data(), state.size());
}

inline Generator read_generator(StateReader& reader) {
  GeneratorState state{};
  reader.numbers(state.data(), state.size());
  return Generator(state);
}

}  // namespace walker
