// Kernels that are wrong by as little as can be, which the tests must notice.
#pragma once

#include "robots/walker2d/kernel/kernel.h"

namespace walker::walker2d {

extern const Kernel kernel_with_folded_pow;  ///< x * x in place of pow(x, 2)
extern const Kernel kernel_with_fused_add;   ///< one multiplication and addition rounded once

}  // namespace walker::walker2d
