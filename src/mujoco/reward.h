// What a step is worth to Gymnasium's robots that run for as long as they are healthy.
#pragma once

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

}  // namespace walker::mujoco
