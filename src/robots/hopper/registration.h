// Hopper's entries in the registry, and its kernels.
#pragma once

#include <vector>

#include "robots/mujoco/kernel/kernel.h"
#include "walker_sim/registry.h"

namespace walker::hopper {

/// Hopper-v4 and Hopper-v5.
std::vector<Registration> registrations();

/// robots/mujoco/kernel, compiled with the constants of this robot's model.
const mujoco::kernel::Kernels& kernels();

}  // namespace walker::hopper
