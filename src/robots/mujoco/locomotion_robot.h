// Gymnasium's planar robots whose reward and termination depend on health: Hopper and Walker2d.
#pragma once

#include <array>
#include <limits>
#include <string>
#include <vector>

#include "robots/mujoco/planar_robot.h"
#include "walker_sim/registry.h"

namespace walker::mujoco {

/// Constructor parameters that determine reward and termination.
struct RewardOptions {
  double forward_reward_weight;
  double ctrl_cost_weight;
  double healthy_reward;
  bool terminate_when_unhealthy;
  bool is_v5;  ///< v4 also gives the healthy reward for the step that terminates the episode
};

struct RewardTerms {
  double forward;  ///< weight x velocity of the trunk along x
  double control;  ///< minus the action's cost, a float32 value
  double survive;  ///< reward for being healthy

  /// Returns the sum, added in Gymnasium's order.
  double total() const { return forward + survive + control; }
};

/// Returns Gymnasium's reward:
///
///   forward = forward_reward_weight * x_velocity
///   control = -ctrl_cost_weight * sum_i action_i^2
///   survive = healthy_reward if the robot is healthy, else 0; v4: also if terminate_when_unhealthy
///   reward  = forward + survive + control
///
/// Source: Gymnasium 1.4.0, envs/mujoco/walker2d_v5.py and hopper_v5.py, _get_rew, control_cost,
/// healthy_reward; walker2d_v4.py and hopper_v4.py, step, healthy_reward.
///
/// As in Gymnasium with float32 actions under NumPy 2, the action's cost is computed in single
/// precision and everything else in double. If Gymnasium's cost would overflow (actions of 1e19 and
/// more), the cost is the largest float, so the reward stays finite.
/// @param x_velocity mean over the step [m/s]
/// @param is_healthy after the step
/// @param action     `size` values, not clamped to the actuators' ranges; at most 7, because NumPy
///                   sums longer arrays in another order
RewardTerms reward_of_step(const RewardOptions& options, double x_velocity, bool is_healthy,
                           const double* action, int size);

/// `HealthyRange::end` of a range up to the last velocity.
constexpr int kStateEnd = std::numeric_limits<int>::max();

/// Parameter: the interval in which some values of the state must lie for the robot to be healthy:
///
///   low < state_i < high for begin <= i < end,   state = (qpos, qvel)
///
/// In a level, `low` is a bound of the trunk's height above the ground, and `high` of that above
/// the ground or a stump's top (`GroundBelow`).
///
/// Source: Gymnasium 1.4.0, envs/mujoco/walker2d_v5.py and hopper_v5.py, is_healthy.
struct HealthyRange {
  std::string name;
  std::string unit;
  std::string description;
  std::array<double, 2> interval;  ///< open; the default in a LocomotionRobotKind
  int begin;                       ///< first index into the state: MuJoCo's qpos, then qvel
  int end;                         ///< one past the last index, or kStateEnd
  const char* end_reason;          ///< static text
};

/// Returns healthy_z_range and healthy_angle_range, which all these robots have.
/// @param robot noun for the robot in the parameters' descriptions
std::vector<HealthyRange> torso_ranges(const std::string& robot, std::array<double, 2> heights,
                                       std::array<double, 2> angles);

/// One motor of a memoryless gait. Its control is the constant plus the weighted sum of the
/// observed positions and velocities, clamped to [-1, 1].
struct MotorWeights {
  double constant;
  std::vector<double> of_observation;  ///< [1/m, 1/rad, s/m, s/rad]
};

/// Constants, physics and gait of one of these robots.
struct LocomotionRobotKind {
  std::string name;                 ///< in ids, such as Hopper-v5
  std::string model;                ///< in names of built-in models, such as hopper_v5.xml
  int num_hinges = 0;               ///< hinges that carry a limb
  std::vector<std::string> bodies;  ///< that move, by MuJoCo's names
  double reward_threshold = std::numeric_limits<double>::quiet_NaN();  ///< Gymnasium's; NaN: none
  DampingLimits joint_damping{};                                       ///< of the world's parameter
  double push_impulse = 0;                   ///< default of the world's parameter [N s]
  double leg_length = 0;                     ///< hip to sole of a straight leg [m]
  double camera_distance = 0;                ///< Gymnasium's DEFAULT_CAMERA_CONFIG [m]
  std::vector<HealthyRange> healthy_ranges;  ///< in the order of Gymnasium's parameters
  std::vector<MotorWeights> gait;            ///< in action order; empty: no gait
  /// Creates the physics, as in PlanarOptions; empty: MuJoCo's library.
  std::function<std::unique_ptr<Physics>(ModelPointer)> make_physics;
};

/// Returns the registry's entries for NAME-v4 and NAME-v5. Their robots reproduce Gymnasium's to
/// the bit; observations, rewards and info are doubles.
std::vector<Registration> registrations(LocomotionRobotKind kind);

}  // namespace walker::mujoco
