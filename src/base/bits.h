// A double as its bits, which are equal also where a NaN or a -0 is.
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
