#define WALKER_SIM_ROBOT walker2d
#define WALKER_SIM_MODEL_CONSTANTS "robots/walker2d/model_constants.h"
#define WALKER_SIM_INSTRUCTION_SET avx2
#include "robots/walker2d/kernel/kernel.h"

#include "robots/mujoco/kernel/runge_kutta.h"

namespace walker::walker2d {

const mujoco::kernel::Kernel kernel_avx2 = mujoco::kernel::walker2d::make_kernel<4>("avx2");

}  // namespace walker::walker2d
