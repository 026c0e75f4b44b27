// MuJoCo's step, specialized for Walker2d: the library's results to the bit, many times faster.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

namespace walker::walker2d {

/// Numbers of the model that may differ between worlds, in place of the kernel's constants: those
/// of worlds with other physics, and the feet's friction, in which Walker2d-v4 and v5 differ.
/// @tparam V a number, or a vector with a number of each lane's world
template <typename V>
struct ModelValues {
  static constexpr std::size_t kLimbs = 7;  ///< bodies that move, in their order
  static constexpr std::size_t kMotors = 6;

  V gravity;                       ///< opt_gravity along z [m/s^2]
  V damping;                       ///< dof_damping of each limb's hinge [N m s]
  V mean_inertia;                  ///< stat_meaninertia
  V mass[kLimbs];                  ///< body_mass [kg]
  V inverse_subtree_mass[kLimbs];  ///< of a limb with all that it carries [1/kg]
  V inertia[kLimbs][3];            ///< body_inertia [kg m^2]
  V limit_weight[kMotors];         ///< dof_invweight0 of each limb's hinge
  V friction[kLimbs];              ///< of the contacts with the floor
  V diagonal[kLimbs];              ///< MuJoCo's diagApprox of a contact's rows
};

/// State that MuJoCo's steps pass from one to the next, and what acts in them.
struct World {
  static constexpr std::size_t kSize = 9;
  static constexpr std::size_t kMotors = ModelValues<double>::kMotors;

  std::array<double, kSize> position{};         ///< qpos [m, rad]
  std::array<double, kSize> velocity{};         ///< qvel [m/s, rad/s]
  std::array<double, kSize> warm_start{};       ///< qacc_warmstart, from which the solver starts
  std::array<double, kMotors> torque{};         ///< of the motors [N m]
  std::array<double, 2> push{};                 ///< force on the trunk along x and z [N]
  const ModelValues<double>* values = nullptr;  ///< must be set
  unsigned pattern = 0;     ///< equal for worlds with the same contacts and limits
  bool is_flagged = false;  ///< the library must redo this step from the state before it
};

using StepWorlds = void (*)(World* const* worlds, std::size_t count, int steps);

/// The kernel for one instruction set.
struct Kernel {
  const char* instruction_set;
  int lanes;  ///< worlds that `step` solves together

  /// Makes engine steps of distinct worlds. Flags worlds for which the library would warn or may
  /// give a zero another sign; their state is then undefined.
  StepWorlds step;
  /// Like `step`, but one world at a time: faster for a single world.
  StepWorlds step_singly;

  /// Computes the warm start of a new state, without torques and push. Flags the world as `step`
  /// does.
  void (*start)(World& world);
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
