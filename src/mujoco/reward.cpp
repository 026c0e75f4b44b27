#include "mujoco/reward.h"

#include <algorithm>
#include <limits>

namespace walker::mujoco {
namespace {

/// In single precision; what lies beyond its range becomes its largest number.
float saturated(double value) {
  constexpr double kLargest = std::numeric_limits<float>::max();
  return static_cast<float>(std::clamp(value, -kLargest, kLargest));
}

}  // namespace

RewardTerms reward_of_step(const RewardOptions& options, double x_velocity, bool is_healthy,
                           const double* action, int size) {
  float sum = 0;
  for (int i = 0; i < size; ++i) {
    const float value = saturated(action[i]);
    sum += value * value;
  }
  // An infinite sum would make the cost infinite, or with a weight of 0 no number.
  const float finite_sum = std::min(sum, std::numeric_limits<float>::max());
  const float cost = saturated(double{static_cast<float>(options.ctrl_cost_weight) * finite_sum});
  const bool survives =
      is_healthy || (!options.healthy_reward_needs_health && options.terminate_when_unhealthy);
  return {options.forward_reward_weight * x_velocity, double{-cost},
          (survives ? 1.0 : 0.0) * options.healthy_reward};
}

}  // namespace walker::mujoco
