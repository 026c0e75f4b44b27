#define WALKER_SIM_ROBOT walker2d
#define WALKER_SIM_MODEL_CONSTANTS "robots/walker2d/model_constants.h"
#define WALKER_SIM_INSTRUCTION_SET fused_add
#define WALKER_SIM_FUSE_ADD
#include "robots/mujoco/kernel/altered.h"
#include "robots/mujoco/kernel/runge_kutta.h"

namespace walker::mujoco::kernel {

const Kernel kernel_with_fused_add = walker2d::make_kernel<1>("fused_add");

}  // namespace walker::mujoco::kernel
