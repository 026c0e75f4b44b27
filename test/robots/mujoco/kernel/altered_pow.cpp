#define WALKER_SIM_ROBOT walker2d
#define WALKER_SIM_MODEL_CONSTANTS "robots/walker2d/model_constants.h"
#define WALKER_SIM_INSTRUCTION_SET folded_pow
#define WALKER_SIM_FOLD_POW
#include "robots/mujoco/kernel/altered.h"
#include "robots/mujoco/kernel/runge_kutta.h"

namespace walker::mujoco::kernel {

const Kernel kernel_with_folded_pow{"folded_pow", 1, walker2d::step_worlds<1>,
                                    walker2d::step_worlds<1>, walker2d::start_world};

}  // namespace walker::mujoco::kernel
