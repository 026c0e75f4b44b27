#define WALKER_SIM_INSTRUCTION_SET folded_pow
#define WALKER_SIM_FOLD_POW
#include "robots/walker2d/kernel/altered.h"
#include "robots/walker2d/kernel/runge_kutta.h"

namespace walker::walker2d {

const Kernel kernel_with_folded_pow{"folded_pow", 1, kernel::step_worlds<1>, kernel::step_worlds<1>,
                                    kernel::start_world};

}  // namespace walker::walker2d
