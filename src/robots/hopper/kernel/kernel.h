// Hopper's kernels: robots/mujoco/kernel, compiled with its model's constants.
#pragma once

#include "robots/mujoco/kernel/kernel.h"

namespace walker::hopper {

// One translation unit for each instruction set.
extern const mujoco::kernel::Kernel kernel_sse2;
extern const mujoco::kernel::Kernel kernel_avx2;

const mujoco::kernel::Kernels& kernels();

}  // namespace walker::hopper
