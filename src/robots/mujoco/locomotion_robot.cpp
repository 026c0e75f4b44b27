#include "robots/mujoco/locomotion_robot.h"

#include <algorithm>
#include <utility>

#include "robots/mujoco/planar_base.h"

namespace walker::mujoco {
namespace {

/// Indices into v5's info. v4's has the position and the velocity only.
enum InfoIndex : std::size_t {
  kPositionX,
  kDistanceZ,
  kVelocityX,
  kRewardForward,
  kRewardControl,
  kRewardSurvive
};

/// Converts to single precision, clamped to its finite range.
float saturated(double value) {
  constexpr double kMax = std::numeric_limits<float>::max();
  return static_cast<float>(std::clamp(value, -kMax, kMax));
}

}  // namespace

RewardTerms reward_of_step(const RewardOptions& options, double x_velocity, bool is_healthy,
                           const double* action, int size) {
  float sum = 0;
  for (int i = 0; i < size; ++i) {
    const float value = saturated(action[i]);
    sum += value * value;
  }
  // An infinite sum would make the cost infinite, or NaN with a weight of 0.
  const float finite_sum = std::min(sum, std::numeric_limits<float>::max());
  const float cost = saturated(double{static_cast<float>(options.ctrl_cost_weight) * finite_sum});
  const bool survives =
      is_healthy || (!options.healthy_reward_needs_health && options.terminate_when_unhealthy);
  return {options.forward_reward_weight * x_velocity, double{-cost},
          (survives ? 1.0 : 0.0) * options.healthy_reward};
}

HealthyRange height_range(const std::string& robot, double low, double high) {
  return {"healthy_z_range",
          "m",
          "Heights of the torso between which the " + robot + " is healthy.",
          {low, high},
          kBaseZ,
          kBaseZ + 1,
          "the torso's height left healthy_z_range"};
}

HealthyRange angle_range(const std::string& robot, double low, double high) {
  return {"healthy_angle_range",
          "rad",
          "Angles of the torso between which the " + robot + " is healthy.",
          {low, high},
          kBasePitch,
          kBasePitch + 1,
          "the torso's angle left healthy_angle_range"};
}

LocomotionRobot::LocomotionRobot(const PlanarOptions& options, const RewardOptions& reward,
                                 std::vector<HealthyRange> healthy_ranges, bool is_v5)
    : PlanarRobot(options),
      reward_(reward),
      healthy_ranges_(std::move(healthy_ranges)),
      is_v5_(is_v5) {}

void LocomotionRobot::write_reset_info(double* info) const {
  if (!is_v5_) return;
  info[kPositionX] = position()[kBaseX];
  info[kDistanceZ] = position()[kBaseZ] - model().qpos0[kBaseZ];
}

void LocomotionRobot::conclude_step(double x_velocity, RobotStep& step) const {
  const char* const illness = unhealthy_reason();
  const bool is_healthy = illness[0] == '\0';
  const RewardTerms terms =
      reward_of_step(reward_, x_velocity, is_healthy, step.action, model().nu);
  step.reward = terms.total();
  step.terminated = !is_healthy && reward_.terminate_when_unhealthy;
  step.end_reason = step.terminated ? illness : "";
  if (is_v5_) {
    write_reset_info(step.info);
    step.info[kVelocityX] = x_velocity;
    step.info[kRewardForward] = terms.forward;
    step.info[kRewardControl] = terms.control;
    step.info[kRewardSurvive] = terms.survive;
  } else {
    step.info[0] = position()[kBaseX];
    step.info[1] = x_velocity;
  }
}

/// Returns a static text; empty if the robot is healthy.
const char* LocomotionRobot::unhealthy_reason() const {
  const int nq = model().nq;
  const int state_size = nq + model().nv;
  for (const HealthyRange& range : healthy_ranges_) {
    const int end = std::min(range.end, state_size);
    for (int i = range.begin; i < end; ++i) {
      const double value = i < nq ? position()[i] : velocity()[i - nq];
      const bool is_within = range.interval[0] < value && value < range.interval[1];
      if (!is_within) return range.end_reason;
    }
  }
  return "";
}

}  // namespace walker::mujoco
