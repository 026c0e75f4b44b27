// Whether a kernel is as Box2D on the machine at hand.
#pragma once

#include "robots/bipedal_walker/kernel/kernel.h"
#include "simd/choose_kernel.h"

namespace walker::bipedal_walker {

using KernelChoice = simd::KernelChoice<Kernel>;

/// The fastest kernel that the user allows and that this processor can run. None where some hundred
/// steps, or sines and cosines, show other bits than Box2D and the C library have here, which is
/// tried once in a process.
/// @throws std::invalid_argument where the user asks for what there is not
KernelChoice choose_kernel();

/// Whether the kernel's rotations are the C library's, and its steps Box2D's.
bool is_as_box2d(const Kernel& kernel);

}  // namespace walker::bipedal_walker
