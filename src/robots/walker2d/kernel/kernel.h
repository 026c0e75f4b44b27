// MuJoCo's step of one model, Walker2d's, as code of its own: the library's bits, many times
// faster.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "robots/walker2d/kernel/ground.h"

namespace walker::walker2d {

/// All that MuJoCo's steps carry from one to the next.
struct World {
  static constexpr std::size_t kSize = 9;
  static constexpr std::size_t kMotors = 6;

  std::array<double, kSize> position{};    ///< qpos [m, rad]
  std::array<double, kSize> velocity{};    ///< qvel [m/s, rad/s]
  std::array<double, kSize> warm_start{};  ///< qacc_warmstart, from which the solver starts
  std::array<double, kMotors> torque{};    ///< of the motors [N m]
  unsigned pattern = 0;                    ///< alike in worlds with like contacts and limits
  bool is_flagged = false;  ///< the library must make this step, from the state before it
};

using StepWorlds = void (*)(World* const* worlds, std::size_t count, int steps,
                            const Ground& ground);

/// One compilation of the kernel.
struct Kernel {
  const char* instruction_set;
  int lanes;  ///< worlds that `step` solves together

  /// Makes engine steps of distinct worlds. Flags those for which the library would warn or may
  /// give a zero another sign; what it leaves in these is of no meaning.
  StepWorlds step;
  /// The same one world at a time: faster for a single one.
  StepWorlds step_singly;

  /// Computes the warm start of a new state, without torques. Flags as `step`.
  void (*start)(World& world, const Ground& ground);
};

/// Those that this processor can run, the one with the most lanes first.
std::vector<const Kernel*> kernels();

}  // namespace walker::walker2d
