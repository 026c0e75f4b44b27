// A planar robot's physics, stepped by its kernel, and the choice of a kernel: one whose constants
// are the model's and whose results on this machine are the library's.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "robots/mujoco/kernel/kernel.h"
#include "robots/mujoco/physics.h"
#include "simd/choose_kernel.h"

namespace walker::mujoco::kernel {

/// A robot's kernels.
struct Kernels {
  /// Those that this processor can run, the one with the most lanes first.
  std::vector<const Kernel*> usable;
  /// Returns the first field of the model that differs from the kernels' constants; empty if no
  /// field that a step reads differs.
  std::string (*unsupported_reason)(const mjModel& model);
};

/// Creates physics that step with a kernel and redo flagged steps with the library. If
/// `choose_kernel` finds no kernel, they step with the library only.
std::unique_ptr<Physics> make_physics(const Kernels& kernels, ModelPointer model);

using KernelChoice = simd::KernelChoice<Kernel>;

/// Returns the fastest kernel that the user allows, this processor can run, and `is_as_library`
/// accepts; each kernel is tried once per process. Returns none, with the reason, if the kernels'
/// constants do not cover the model or no kernel passes.
/// @throws std::invalid_argument if WALKER_SIM_KERNEL has an unknown value
KernelChoice choose_kernel(const Kernels& kernels, const mjModel& model);

/// @param model covered, or a covered base model with a world's values
ModelValues<double> values_of(const mjModel& model);

/// Selects the faster sincos for `sine_and_cosine_of` if it has the bits of sin and cos on 50,000
/// angles: not in glibc 2.31, but in 2.36. Checks once per process.
void choose_sine_and_cosine();

/// Whether some 200 steps, from standing to extreme states, equal the library's to the bit.
/// @param model must be covered
bool is_as_library(const Kernel& kernel, const mjModel& model);

/// Copies the state that steps pass on from the library's data; not the torques.
void read_state(const mjModel& model, const mjData& data, Instance& instance);

/// Whether this state equals the library's to the bit.
bool has_state(const mjModel& model, const Instance& instance, const mjData& data);

}  // namespace walker::mujoco::kernel
