#define WALKER_SIM_INSTRUCTION_SET sse2
#include "robots/walker2d/kernel/kernel.h"
#include "robots/walker2d/kernel/runge_kutta.h"

namespace walker::walker2d {

const Kernel kernel_sse2{"sse2", 2, kernel::step_worlds<2>, kernel::step_worlds<1>,
                         kernel::start_world};

}  // namespace walker::walker2d
