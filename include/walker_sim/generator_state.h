// State of an environment's random number generator.
#pragma once

#include <array>
#include <cstdint>

namespace walker {

/// State of NumPy's PCG64: state (high, low), increment (high, low), has_uint32, uinteger.
using GeneratorState = std::array<std::uint64_t, 6>;

}  // namespace walker
