#include "walker2d/kernel/kernel.h"

#include "walker2d/kernel/instruction_sets.h"
#include "walker2d/kernel/suppositions.h"

namespace walker::walker2d {

std::vector<const Kernel*> kernels() {
  std::vector<const Kernel*> usable;
#ifdef WALKER_SIM_HAS_KERNELS
  if (__builtin_cpu_supports("avx2")) usable.push_back(&kernel_avx2);
  usable.push_back(&kernel_sse2);
#endif
  return usable;
}

}  // namespace walker::walker2d
