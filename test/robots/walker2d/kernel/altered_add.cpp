#define WALKER_SIM_INSTRUCTION_SET fused_add
#define WALKER_SIM_FUSE_ADD
#include "robots/walker2d/kernel/altered.h"
#include "robots/walker2d/kernel/runge_kutta.h"

namespace walker::walker2d {

const Kernel kernel_with_fused_add{"fused_add", 1, kernel::step_worlds<1>, kernel::step_worlds<1>,
                                   kernel::start_world};

}  // namespace walker::walker2d
