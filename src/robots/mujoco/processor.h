// Dependence of MuJoCo's library on the processor: required instructions, variant of libm.
#pragma once

#include <string>

namespace walker::mujoco {

/// Whether the processor and the operating system support AVX, which MuJoCo's releases for x86-64
/// require. True on other architectures.
bool has_needed_instructions();

/// @param has_needed overridden by tests
/// @throws std::runtime_error naming what is missing
void check_processor(bool has_needed = has_needed_instructions());

/// Returns the name of the variant of the C library's sin, cos and pow. glibc has one for
/// processors with FMA ("fma") and one for those without ("no fma"), whose results differ in the
/// last bits. Any other library is named by a hash of its results.
const std::string& libm_variant();

}  // namespace walker::mujoco
