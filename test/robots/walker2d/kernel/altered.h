// Kernels with minimal errors, which the tests must detect.
#pragma once

#include "robots/walker2d/kernel/kernel.h"

namespace walker::walker2d {

extern const Kernel kernel_with_folded_pow;  ///< x * x instead of pow(x, 2)
extern const Kernel kernel_with_fused_add;   ///< one multiplication and addition fused

}  // namespace walker::walker2d
