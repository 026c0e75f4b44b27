#include "robots/bipedal_walker/kernel/kernel.h"

#include "simd/choose_kernel.h"

namespace walker::bipedal_walker {

std::vector<const Kernel*> kernels() {
#ifndef WALKER_SIM_HAS_KERNELS
  return {};
#elif defined(__aarch64__)
  return simd::usable_kernels<Kernel>({&kernel_neon});
#else
  return simd::usable_kernels<Kernel>({&kernel_avx512, &kernel_avx2, &kernel_sse2});
#endif
}

}  // namespace walker::bipedal_walker
