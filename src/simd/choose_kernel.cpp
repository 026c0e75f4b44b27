#include "simd/choose_kernel.h"

namespace walker::simd {

const std::vector<std::string>& instruction_sets() {
  static const std::vector<std::string> kSets = [] {
    std::vector<std::string> sets;
#ifdef __x86_64__
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
        __builtin_cpu_supports("avx512vl")) {
      sets.emplace_back("avx512");
    }
    if (__builtin_cpu_supports("avx2")) sets.emplace_back("avx2");
    sets.emplace_back("sse2");
#elif defined(__aarch64__)
    sets.emplace_back("neon");
#endif
    return sets;
  }();
  return kSets;
}

}  // namespace walker::simd
