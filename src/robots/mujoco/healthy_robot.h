// Gymnasium's planar robots that run for as long as they are healthy: Hopper and Walker2d.
#pragma once

#include <array>
#include <limits>
#include <string>
#include <vector>

#include "robots/mujoco/planar_robot.h"
#include "walker_sim/registry.h"

namespace walker::mujoco {

/// The constructor's parameters that decide the reward.
struct RewardOptions {
  double forward_reward_weight;
  double ctrl_cost_weight;
  double healthy_reward;
  bool terminate_when_unhealthy;
  bool healthy_reward_needs_health;  ///< v5; v4 gives it also for the step that ends the episode
};

/// The parts of a reward.
struct RewardTerms {
  double forward;  ///< weight x velocity of the trunk along x
  double control;  ///< minus the cost of the action, a float32 value
  double survive;  ///< for being healthy

  /// Added in Gymnasium's order.
  double total() const { return forward + survive + control; }
};

/// Gymnasium's reward. With float32 actions under NumPy 2 the cost of the action is computed in
/// single precision, everything else in double. Where Gymnasium's cost would overflow (actions of
/// 1e19 and more) it is the largest single-precision number, so that the reward stays finite.
/// @param x_velocity mean over the step [m/s]
/// @param is_healthy after the step
/// @param action     `size` values as given, not limited to the actuators' ranges; up to 7, for
///                   NumPy adds more in another order
RewardTerms reward_of_step(const RewardOptions& options, double x_velocity, bool is_healthy,
                           const double* action, int size);

/// End of a range that reaches to the last velocity.
constexpr int kStateEnd = std::numeric_limits<int>::max();

/// A parameter: numbers of the state between which the robot is healthy.
struct HealthyRange {
  std::string name;
  std::string unit;
  std::string description;
  std::array<double, 2> interval;  ///< open; of a kind the default
  int begin;                       ///< in the state: positions, then velocities, as MuJoCo has them
  int end;                         ///< or kStateEnd
  const char* end_reason;          ///< static text
};

/// healthy_z_range and healthy_angle_range, which each of them has.
/// @param robot what it is called in a sentence
HealthyRange height_range(const std::string& robot, double low, double high);
HealthyRange angle_range(const std::string& robot, double low, double high);

/// What one motor does in a gait without memory: its control is this sum of the observed positions
/// and velocities, limited to [-1, 1].
struct MotorWeights {
  double constant;
  std::vector<double> of_observation;  ///< [1/m, 1/rad, s/m, s/rad]
};

/// What distinguishes one of these robots from another, from its constants to its gait.
struct HealthyRobotKind {
  std::string name;    ///< of the ids, and in snake case of the models: HalfCheetah, half_cheetah
  int num_hinges = 0;  ///< of limbs
  double reward_threshold = std::numeric_limits<double>::quiet_NaN();  ///< Gymnasium's; NaN: none
  double camera_distance = 0;                ///< Gymnasium's DEFAULT_CAMERA_CONFIG [m]
  std::vector<HealthyRange> healthy_ranges;  ///< in the order of Gymnasium's parameters
  std::vector<MotorWeights> gait;            ///< in action order; empty: there is none
  /// What steps it, as in PlanarOptions; empty: MuJoCo's library.
  std::function<std::unique_ptr<Physics>(ModelPointer)> make_physics;
};

/// NAME-v4 and NAME-v5, with their models, observations, pictures and gait.
std::vector<Registration> registrations(HealthyRobotKind kind);

/// Gymnasium's versions 4 and 5, to the bit: observations, rewards and info are doubles.
class HealthyRobot : public PlanarRobot {
 public:
  /// @param is_v5 v5's info; v4's is shorter, and empty at a reset
  /// @throws std::invalid_argument if the model is not a planar robot (two slides and a hinge)
  HealthyRobot(const PlanarOptions& options, const RewardOptions& reward,
               std::vector<HealthyRange> healthy_ranges, bool is_v5);

  std::optional<bool> is_healthy() const override { return why_unhealthy()[0] == '\0'; }

 private:
  void write_reset_info(double* info) const override;
  void conclude_step(double x_velocity, RobotStep& step) const override;
  const char* why_unhealthy() const;

  RewardOptions reward_;
  std::vector<HealthyRange> healthy_ranges_;
  bool is_v5_;
};

}  // namespace walker::mujoco
