#define WALKER_SIM_INSTRUCTION_SET sse2
#include "robots/bipedal_walker/kernel/solve.h"

namespace walker::bipedal_walker {

const Kernel kernel_sse2 = kernel::make_kernel<4>("sse2");

}  // namespace walker::bipedal_walker
