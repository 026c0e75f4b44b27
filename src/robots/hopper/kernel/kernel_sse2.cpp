#define WALKER_SIM_ROBOT hopper
#define WALKER_SIM_MODEL_CONSTANTS "robots/hopper/model_constants.h"
#define WALKER_SIM_INSTRUCTION_SET sse2
#include "robots/hopper/kernel/kernel.h"

#include "robots/mujoco/kernel/runge_kutta.h"

namespace walker::hopper {

const mujoco::kernel::Kernel kernel_sse2{"sse2", 2, mujoco::kernel::hopper::step_worlds<2>,
                                         mujoco::kernel::hopper::step_worlds<1>,
                                         mujoco::kernel::hopper::start_world};

}  // namespace walker::hopper
