#define WALKER_SIM_INSTRUCTION_SET neon
#include "robots/bipedal_walker/kernel/solve.h"

namespace walker::bipedal_walker {

const Kernel kernel_neon = kernel::make_kernel<4>("neon");

}  // namespace walker::bipedal_walker
