#define WALKER_SIM_ROBOT walker2d
#define WALKER_SIM_MODEL_CONSTANTS "robots/walker2d/model_constants.h"
#define WALKER_SIM_INSTRUCTION_SET folded_pow
#define WALKER_SIM_FOLD_POW
#include "robots/mujoco/kernel/altered.h"
#include "robots/mujoco/kernel/runge_kutta.h"

namespace walker::mujoco::kernel {

const Kernel kernel_with_folded_pow = walker2d::make_kernel<1>("folded_pow");

}  // namespace walker::mujoco::kernel
