#define WALKER_SIM_ROBOT walker2d
#define WALKER_SIM_MODEL_CONSTANTS "robots/walker2d/model_constants.h"
#include "robots/walker2d/kernel/kernel.h"

#include "robots/mujoco/kernel/covered_model.h"
#include "robots/mujoco/kernel/kernel_physics.h"
#include "simd/choose_kernel.h"

namespace walker::walker2d {

const mujoco::kernel::Kernels& kernels() {
#ifdef WALKER_SIM_HAS_KERNELS
  static const std::vector<const mujoco::kernel::Kernel*> kCompiled{&kernel_avx2, &kernel_sse2};
#else
  static const std::vector<const mujoco::kernel::Kernel*> kCompiled;
#endif
  static const mujoco::kernel::Kernels kKernels{simd::usable_kernels(kCompiled),
                                                mujoco::kernel::walker2d::unsupported_reason};
  return kKernels;
}

}  // namespace walker::walker2d
