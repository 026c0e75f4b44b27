// MuJoCo's step, specialized for Walker2d: the library's results to the bit, many times faster.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

namespace walker::walker2d {

/// State that MuJoCo's steps pass from one to the next.
struct World {
  static constexpr std::size_t kSize = 9;
  static constexpr std::size_t kMotors = 6;

  std::array<double, kSize> position{};    ///< qpos [m, rad]
  std::array<double, kSize> velocity{};    ///< qvel [m/s, rad/s]
  std::array<double, kSize> warm_start{};  ///< qacc_warmstart, from which the solver starts
  std::array<double, kMotors> torque{};    ///< of the motors [N m]
  unsigned pattern = 0;                    ///< equal for worlds with the same contacts and limits
  bool is_flagged = false;  ///< the library must redo this step from the state before it
};

/// Contact parameters of the floor with each limb, in the order of bodies. The models of
/// Walker2d-v4 and v5 differ in them.
struct Ground {
  static constexpr std::size_t kLimbs = 7;
  std::array<double, kLimbs> friction{};
  std::array<double, kLimbs> diagonal{};  ///< MuJoCo's diagApprox of a contact's rows
};

using StepWorlds = void (*)(World* const* worlds, std::size_t count, int steps,
                            const Ground& ground);

/// The kernel for one instruction set.
struct Kernel {
  const char* instruction_set;
  int lanes;  ///< worlds that `step` solves together

  /// Makes engine steps of distinct worlds. Flags worlds for which the library would warn or may
  /// give a zero another sign; their state is then undefined.
  StepWorlds step;
  /// Like `step`, but one world at a time: faster for a single world.
  StepWorlds step_singly;

  /// Computes the warm start of a new state, without torques. Flags the world as `step` does.
  void (*start)(World& world, const Ground& ground);
};

/// Computes sine and cosine of an angle [rad] with the bits of the C library's sin and cos, which
/// MuJoCo calls.
extern void (*sine_and_cosine_of)(double angle, double* sine, double* cosine);

// One translation unit for each instruction set.
extern const Kernel kernel_sse2;
extern const Kernel kernel_avx2;

/// Returns the kernels that this processor can run, the one with the most lanes first.
std::vector<const Kernel*> kernels();

}  // namespace walker::walker2d
