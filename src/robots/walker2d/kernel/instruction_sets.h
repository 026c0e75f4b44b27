// The compiled kernels, one translation unit per instruction set.
#pragma once

#include "robots/walker2d/kernel/kernel.h"

namespace walker::walker2d {

extern const Kernel kernel_sse2;
extern const Kernel kernel_avx2;

}  // namespace walker::walker2d
