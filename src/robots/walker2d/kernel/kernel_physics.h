// Walker2d's physics, stepped by the kernel.
#pragma once

#include <memory>

#include "robots/mujoco/physics.h"

namespace walker::walker2d {

/// Creates physics that step with the kernel and redo flagged steps with the library. If
/// `choose_kernel` finds no kernel, they step with the library only.
std::unique_ptr<mujoco::Physics> make_kernel_physics(mujoco::ModelPointer model);

}  // namespace walker::walker2d
