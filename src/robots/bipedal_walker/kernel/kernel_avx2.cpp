#define WALKER_SIM_INSTRUCTION_SET avx2
#include "robots/bipedal_walker/kernel/solve.h"

namespace walker::bipedal_walker {

const Kernel kernel_avx2 = kernel::make_kernel<8>("avx2");

}  // namespace walker::bipedal_walker
