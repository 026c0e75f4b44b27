#define WALKER_SIM_INSTRUCTION_SET avx512
#include "robots/bipedal_walker/kernel/solve.h"

namespace walker::bipedal_walker {

const Kernel kernel_avx512 = kernel::make_kernel<16>("avx512");

}  // namespace walker::bipedal_walker
