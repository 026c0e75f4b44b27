// Choice of a robot's kernel: the first one that the user allows and that gives the engine's bits
// on this machine.
#pragma once

#include <algorithm>
#include <cstdlib>
#include <iterator>
#include <map>
#include <mutex>
#include <stdexcept>
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

template <typename Kernel>
struct AllowedKernels {
  std::vector<const Kernel*> kernels;
  std::string fallback_reason;  ///< if there are none
};

/// A kernel, or the reason for using none.
template <typename Kernel>
struct KernelChoice {
  const Kernel* kernel = nullptr;
  std::string fallback_reason;
};

/// Returns the kernels that the environment variable WALKER_SIM_KERNEL allows: all if it is not
/// set, none if it is "off", else the named instruction set's and, after it, those of smaller sets.
/// No bit depends on it.
/// @param usable kernels that this processor can run
/// @throws std::invalid_argument naming the variable's possible values
template <typename Kernel>
AllowedKernels<Kernel> allowed_kernels(const std::vector<const Kernel*>& usable) {
  constexpr const char* kVariable = "WALKER_SIM_KERNEL";
  const char* const text = std::getenv(kVariable);
  const std::string wanted = text != nullptr ? text : "";
  if (wanted == "off") return {{}, std::string(kVariable) + " is off"};
  const std::vector<std::string>& sets = instruction_sets();
  auto allowed = sets.begin();
  if (!wanted.empty()) {
    allowed = std::find(sets.begin(), sets.end(), wanted);
    if (allowed == sets.end()) {
      std::string names = "off";
      for (const std::string& set : sets) names += ", " + set;
      throw std::invalid_argument(kVariable + (" = " + wanted) + ": must be one of " + names +
                                  ", or not set");
    }
  }
  AllowedKernels<Kernel> kernels{{}, "there is no kernel for this processor"};
  std::copy_if(usable.begin(), usable.end(), std::back_inserter(kernels.kernels),
               [&](const Kernel* kernel) {
                 return std::find(allowed, sets.end(), kernel->instruction_set) != sets.end();
               });
  return kernels;
}

/// Returns the first kernel that passes a test, which runs once per process and kernel.
/// @param has_engines_bits returns whether a kernel's results equal the engine's on this machine
template <typename Kernel, typename Test>
KernelChoice<Kernel> choose_kernel(const AllowedKernels<Kernel>& allowed,
                                   const Test& has_engines_bits) {
  static std::mutex mutex;
  static std::map<const Kernel*, bool> known;
  if (allowed.kernels.empty()) return {nullptr, allowed.fallback_reason};
  const std::lock_guard<std::mutex> lock(mutex);
  for (const Kernel* kernel : allowed.kernels) {
    auto found = known.find(kernel);
    if (found == known.end()) found = known.emplace(kernel, has_engines_bits(*kernel)).first;
    if (found->second) return {kernel, ""};
  }
  return {nullptr, "the kernel's results differ from the engine's on this machine"};
}

}  // namespace walker::simd
