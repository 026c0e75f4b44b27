// Tests whether a kernel gives Box2D's bits on this machine.
#pragma once

#include "robots/bipedal_walker/kernel/kernel.h"
#include "simd/choose_kernel.h"

namespace walker::bipedal_walker {

using KernelChoice = simd::KernelChoice<Kernel>;

/// Returns the fastest kernel that the user allows, that this processor can run and that passes
/// `has_box2ds_bits`, if any. Each kernel is tested once per process.
/// @throws std::invalid_argument if WALKER_SIM_KERNEL has an unknown value
KernelChoice choose_kernel();

/// Whether rotations have the C library's bits, and some hundred steps have Box2D's.
bool has_box2ds_bits(const Kernel& kernel);

}  // namespace walker::bipedal_walker
