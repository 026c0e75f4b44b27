#include "robots/walker2d/kernel/kernel.h"

#include "robots/walker2d/kernel/assumptions.h"
#include "simd/choose_kernel.h"

namespace walker::walker2d {

std::vector<const Kernel*> kernels() {
#ifdef WALKER_SIM_HAS_KERNELS
  return simd::usable_kernels<Kernel>({&kernel_avx2, &kernel_sse2});
#else
  return {};
#endif
}

}  // namespace walker::walker2d
