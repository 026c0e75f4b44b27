#define WALKER_SIM_INSTRUCTION_SET avx2
#include "robots/walker2d/kernel/kernel.h"
#include "robots/walker2d/kernel/runge_kutta.h"

namespace walker::walker2d {

const Kernel kernel_avx2{"avx2", 4, kernel::step_worlds<4>, kernel::step_worlds<1>,
                         kernel::start_world};

}  // namespace walker::walker2d
