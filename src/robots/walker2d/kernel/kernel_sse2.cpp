#define WALKER_SIM_ROBOT walker2d
#define WALKER_SIM_MODEL_CONSTANTS "robots/walker2d/model_constants.h"
#define WALKER_SIM_INSTRUCTION_SET sse2
#include "robots/walker2d/kernel/kernel.h"

#include "robots/mujoco/kernel/runge_kutta.h"

namespace walker::walker2d {

const mujoco::kernel::Kernel kernel_sse2 = mujoco::kernel::walker2d::make_kernel<2>("sse2");

}  // namespace walker::walker2d
