// Which of a robot's kernels the user allows.
#pragma once

#include <algorithm>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <vector>

namespace walker::simd {

/// What the environment variable WALKER_SIM_KERNEL says of kernels: all where it is not set, none
/// where it is "off", else the one of that set of instructions. No bit depends on it.
/// @param usable with a member `instruction_set`; those that this processor can run
/// @throws std::invalid_argument naming what may be asked for
template <typename Kernel>
std::vector<const Kernel*> allowed_kernels(const std::vector<const Kernel*>& usable) {
  constexpr const char* kVariable = "WALKER_SIM_KERNEL";
  const char* const text = std::getenv(kVariable);
  const std::string wanted = text != nullptr ? text : "";
  if (wanted.empty()) return usable;
  if (wanted == "off") return {};
  std::string names = "off";
  for (const Kernel* kernel : usable) {
    if (wanted == kernel->instruction_set) return {kernel};
    names += std::string(", ") + kernel->instruction_set;
  }
  throw std::invalid_argument(kVariable + (" = " + wanted) + ": must be one of " + names +
                              ", or not set");
}

}  // namespace walker::simd
