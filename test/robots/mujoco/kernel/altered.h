// Walker2d's kernels with minimal errors, which the tests must detect.
#pragma once

#include "robots/mujoco/kernel/kernel.h"

namespace walker::mujoco::kernel {

extern const Kernel kernel_with_folded_pow;  ///< x * x instead of pow(x, 2)
extern const Kernel kernel_with_fused_add;   ///< one multiplication and addition fused

}  // namespace walker::mujoco::kernel
