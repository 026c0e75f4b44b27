// Gymnasium's planar robots that run for as long as they are healthy: Hopper and Walker2d.
#pragma once

#include <array>
#include <limits>
#include <string>
#include <vector>

#include "mujoco/linear_gait.h"
#include "mujoco/planar_robot.h"
#include "mujoco/reward.h"
#include "walker_sim/registry.h"

namespace walker::mujoco {

/// A parameter: numbers of the state between which the robot is healthy.
struct HealthyRange {
  std::string name;
  std::string unit;
  std::string description;
  std::array<double, 2> interval;  ///< open; of a kind the default
  int begin;                       ///< in the state: positions, then velocities, as MuJoCo has them
  int end;
  const char* end_reason;  ///< static text
};

/// healthy_z_range and healthy_angle_range, which each of them has.
/// @param robot what it is called in a sentence
HealthyRange height_range(const std::string& robot, double low, double high);
HealthyRange angle_range(const std::string& robot, double low, double high);

/// What distinguishes one of these robots from another, from its constants to its gait.
struct HealthyRobotKind {
  std::string name;    ///< of the ids, e.g. Walker2d
  std::string robot;   ///< of its models, e.g. walker2d
  int num_hinges = 0;  ///< of limbs
  /// Of Gymnasium's registration; NaN: none.
  double reward_threshold = std::numeric_limits<double>::quiet_NaN();
  double camera_distance = 0;                ///< Gymnasium's DEFAULT_CAMERA_CONFIG [m]
  std::vector<HealthyRange> healthy_ranges;  ///< in the order of Gymnasium's parameters
  std::vector<MotorWeights> gait;
};

/// NAME-v4 and NAME-v5, with their models, observations, pictures and gait.
/// @param kind outlives the process's use of them
std::vector<Registration> registrations(const HealthyRobotKind& kind);

/// Gymnasium's versions 4 and 5, to the bit: observations, rewards and info are doubles.
class HealthyRobot : public PlanarRobot {
 public:
  /// @param is_v5 v5's info; v4's is shorter, and empty at a reset
  /// @throws std::invalid_argument when the model is none of such a robot
  HealthyRobot(const PlanarOptions& options, const RewardOptions& reward,
               std::vector<HealthyRange> healthy_ranges, bool is_v5);

 private:
  void write_reset_info(double* info) const override;
  void conclude_step(const double* action, double x_velocity, Result& result) const override;
  const char* why_unhealthy() const;

  RewardOptions reward_;
  std::vector<HealthyRange> healthy_ranges_;
  bool is_v5_;
};

}  // namespace walker::mujoco
