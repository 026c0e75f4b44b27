// A walker's world, stepped by the kernel.
#pragma once

#include <memory>

#include "robots/mujoco/physics.h"

namespace walker::walker2d {

/// By the kernel, and where that flags a step by the library. By the library alone where the kernel
/// does not cover the model, or does not have the library's bits on this machine.
std::unique_ptr<mujoco::Physics> make_kernel_physics(mujoco::ModelPointer model);

}  // namespace walker::walker2d
