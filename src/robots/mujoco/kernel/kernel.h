// MuJoCo's step, specialized for a planar robot: the library's results to the bit, many times
// faster. The same source is compiled for each robot, with its model's numbers as constants.
//
// A step has four Runge-Kutta stages (runge_kutta.h), each of which computes the accelerations:
//
//   smooth.h         a_smooth = M^-1 (passive - bias + force), without constraints
//   limb_contacts.h  whether limbs may touch each other; if so, the library must make the step
//   touches.h        contacts of limbs with the floor or a level's line
//   constraints.h    a row J of each limit and contact, its stiffness D and reference acceleration
//   solver.h         a = argmin 1/2 |a - a_smooth|_M^2 + the cost of J a - reference, by Newton's
//                    method with an exact line search (line_search.h)
#pragma once

#include <array>
#include <cstddef>

#include "robots/mujoco/ground_contact.h"

namespace walker::mujoco::kernel {

// Sizes of the largest robot; a smaller one leaves the ends of arrays unused.
constexpr std::size_t kMaxLimbs = 7;  ///< bodies that move, in their order
constexpr std::size_t kMaxMotors = 6;
constexpr std::size_t kMaxCoordinates = 9;

/// Numbers of the model that may differ between worlds, in place of the kernel's constants: those
/// of worlds with other physics, and the limbs' friction, in which Walker2d-v4 and v5 differ.
/// @tparam V a number, or a vector with a number of each lane's instance
template <typename V>
struct ModelValues {
  V gravity;                          ///< opt_gravity along z [m/s^2]
  V damping;                          ///< dof_damping of each limb's hinge [N m s]
  V mean_inertia;                     ///< stat_meaninertia
  V mass[kMaxLimbs];                  ///< body_mass [kg]
  V inverse_subtree_mass[kMaxLimbs];  ///< of a limb with all that it carries [1/kg]
  V inertia[kMaxLimbs][3];            ///< body_inertia [kg m^2]
  V limit_weight[kMaxMotors];         ///< dof_invweight0 of each limb's hinge
  V friction[kMaxLimbs];              ///< of the contacts with the floor
  V diagonal[kMaxLimbs];              ///< MuJoCo's diagApprox of a contact's rows
};

/// The floor of the kernels' models, for instances without a level beside some with one.
const GroundLine& flat_floor();

/// State that MuJoCo's steps pass from one to the next, and what acts in them.
struct Instance {
  using Coordinates = std::array<double, kMaxCoordinates>;

  Coordinates position{};                       ///< qpos [m, rad]
  Coordinates velocity{};                       ///< qvel [m/s, rad/s]
  Coordinates warm_start{};                     ///< qacc_warmstart, from which the solver starts
  std::array<double, kMaxMotors> torque{};      ///< of the motors [N m]
  std::array<double, 2> push{};                 ///< force on the trunk along x and z [N]
  const ModelValues<double>* values = nullptr;  ///< must be set
  const GroundLine* line = nullptr;             ///< that limbs touch; null: the flat floor
  unsigned pattern = 0;     ///< equal for instances with the same contacts and limits
  bool is_flagged = false;  ///< the library must redo this step from the state before it
};

using StepInstances = void (*)(Instance* const* instances, std::size_t count, int steps);

/// The kernel of one robot for one instruction set.
struct Kernel {
  const char* instruction_set;
  int lanes;  ///< instances that `step` solves together

  /// Makes engine steps of distinct instances. Flags instances for which the library would warn or
  /// may give a zero another sign, and those whose limbs may touch each other; their state is then
  /// undefined.
  StepInstances step;
  /// Like `step`, but one instance at a time: faster for a single instance.
  StepInstances step_singly;

  /// Computes the warm start of a new state, without torques and push. Flags the instance as `step`
  /// does.
  void (*start)(Instance& instance);
};

struct Kernels;

/// Computes sine and cosine of an angle [rad] with the bits of the C library's sin and cos, which
/// MuJoCo calls.
extern void (*sine_and_cosine_of)(double angle, double* sine, double* cosine);

}  // namespace walker::mujoco::kernel
