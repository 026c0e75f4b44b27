// Whether the kernel is as the library on the machine at hand.
#pragma once

#include "robots/mujoco/engine.h"
#include "robots/walker2d/kernel/kernel.h"
#include "simd/choose_kernel.h"

namespace walker::walker2d {

using KernelChoice = simd::KernelChoice<Kernel>;

/// The fastest kernel that the user allows and that this processor can run. None where the kernels'
/// constants do not cover the model, or where some hundred steps show other bits than MuJoCo's
/// library has here, which is tried once in a process.
/// @throws std::invalid_argument where the user asks for what there is not
KernelChoice choose_kernel(const mjModel& model);

/// Whether the kernel's steps have the library's bits, in states of all kinds.
/// @param model covered
bool is_as_library(const Kernel& kernel, const mjModel& model);

}  // namespace walker::walker2d
