// Instruction sets for which kernels are compiled.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

namespace walker::simd {

/// Names of the sets that this processor supports, widest vectors first: avx512 (its parts F, DQ
/// and VL), avx2, sse2; neon on 64-bit ARM; none elsewhere.
const std::vector<std::string>& instruction_sets();

/// Returns the kernels that this processor can run, in the order of `instruction_sets`.
/// @tparam Kernel with a member `instruction_set`
template <typename Kernel>
std::vector<const Kernel*> usable_kernels(const std::vector<const Kernel*>& compiled) {
  std::vector<const Kernel*> usable;
  for (const std::string& set : instruction_sets()) {
    std::copy_if(compiled.begin(), compiled.end(), std::back_inserter(usable),
                 [&](const Kernel* kernel) { return set == kernel->instruction_set; });
  }
  return usable;
}

}  // namespace walker::simd
