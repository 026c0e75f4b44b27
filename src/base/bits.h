// Bit patterns of doubles: unlike the values, a NaN equals itself, and -0 differs from 0.
#pragma once

#include <cstdint>
#include <cstring>

namespace walker {

inline std::uint64_t to_bits(double value) {
  std::uint64_t bits = 0;
  std::memcpy(&bits, &value, sizeof(bits));
  return bits;
}

}  // namespace walker
