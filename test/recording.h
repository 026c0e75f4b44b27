// Reads the files in test/recordings.
#pragma once

#include <cstdint>
#include <cstring>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>

#include "bits.h"

namespace walker {

/// Reads the words of a recording in sequence and skips its comment lines.
class Recording {
 public:
  explicit Recording(const std::string& name) {
    std::ifstream file(std::string(WALKER_SIM_RECORDINGS "/") + name);
    if (!file) throw std::runtime_error("recording " + name + ": cannot be read");
    for (std::string line; std::getline(file, line);) {
      if (line.empty() || line[0] != '#') text_ << line << '\n';
    }
  }

  bool has_more() { return static_cast<bool>(text_ >> std::ws) && !text_.eof(); }

  template <typename T>
  T next() {
    T value;
    if (!(text_ >> value)) throw std::runtime_error("recording: a word is missing or malformed");
    return value;
  }

  std::uint64_t next_hexadecimal() { return std::stoull(next<std::string>(), nullptr, 16); }

  double next_double() { return from_bits(next_hexadecimal()); }

  /// Reads a number stored as the hexadecimal bits of a float, as next_double does of a double.
  double next_float() {
    const auto bits = static_cast<std::uint32_t>(next_hexadecimal());
    float value = 0;
    std::memcpy(&value, &bits, sizeof(value));
    return double{value};
  }

 private:
  std::stringstream text_;
};

/// 64-bit FNV-1a over the bytes of doubles, as in gymnasium_reference.hashes.
class Hash {
 public:
  void add(double value) {
    std::uint64_t bits = to_bits(value);
    for (std::size_t byte = 0; byte < sizeof(bits); ++byte) {
      state_ = (state_ ^ (bits & 0xFFU)) * 0x100000001B3U;
      bits >>= 8U;
    }
  }

  std::uint64_t value() const { return state_; }

 private:
  std::uint64_t state_ = 0xCBF29CE484222325U;
};

}  // namespace walker
