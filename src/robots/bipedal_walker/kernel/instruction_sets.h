// The kernel's compilations, each in its own translation unit.
#pragma once

#include "robots/bipedal_walker/kernel/kernel.h"

namespace walker::bipedal_walker {

extern const Kernel kernel_sse2;
extern const Kernel kernel_avx2;
extern const Kernel kernel_avx512;
extern const Kernel kernel_neon;

}  // namespace walker::bipedal_walker
