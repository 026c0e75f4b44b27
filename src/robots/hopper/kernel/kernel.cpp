#define WALKER_SIM_ROBOT hopper
#define WALKER_SIM_MODEL_CONSTANTS "robots/hopper/model_constants.h"
#include "robots/hopper/kernel/kernel.h"

#include "robots/mujoco/kernel/covered_model.h"
#include "robots/mujoco/kernel/kernel_physics.h"
#include "simd/choose_kernel.h"

namespace walker::hopper {

const mujoco::kernel::Kernels& kernels() {
#ifdef WALKER_SIM_HAS_KERNELS
  static const std::vector<const mujoco::kernel::Kernel*> kCompiled{&kernel_avx2, &kernel_sse2};
#else
  static const std::vector<const mujoco::kernel::Kernel*> kCompiled;
#endif
  static const mujoco::kernel::Kernels kKernels{simd::usable_kernels(kCompiled),
                                                mujoco::kernel::hopper::unsupported_reason};
  return kKernels;
}

}  // namespace walker::hopper
