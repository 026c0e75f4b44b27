#include "walker2d/reward.h"

namespace walker::walker2d {

RewardTerms reward_of_step(const RewardOptions& options, double x_velocity, bool is_healthy,
                           const double* action) {
  float sum = 0;
  for (int i = 0; i < kJointCount; ++i) {
    const auto value = static_cast<float>(action[i]);
    sum += value * value;
  }
  const float cost = static_cast<float>(options.ctrl_cost_weight) * sum;
  const bool survives =
      is_healthy || (!options.healthy_reward_needs_health && options.terminate_when_unhealthy);
  return {options.forward_reward_weight * x_velocity, double{-cost},
          (survives ? 1.0 : 0.0) * options.healthy_reward};
}

}  // namespace walker::walker2d
