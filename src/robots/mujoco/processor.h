// What MuJoCo's library needs of the processor, and what its bits take from it.
#pragma once

#include <string>

namespace walker::mujoco {

/// Whether the processor and the system have AVX, in which MuJoCo's releases for x86-64 are
/// compiled. True for a library that does not need it.
bool has_needed_instructions();

/// @param has_needed a test may say otherwise
/// @throws std::runtime_error naming what is missing
void check_processor(bool has_needed = has_needed_instructions());

/// Name of the bits that the C library's sin, cos and pow have here: glibc has a variant of each
/// for processors with FMA ("fma") and one for those without ("no fma"), of which the last bits
/// differ. Another library's is named by a hash of its results.
const std::string& libm_variant();

}  // namespace walker::mujoco
