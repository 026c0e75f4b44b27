#include "robots/bipedal_walker/reward.h"

#include <algorithm>
#include <cmath>

#include "robots/bipedal_walker/constants.h"
#include "robots/bipedal_walker/physics.h"

namespace walker::bipedal_walker {

double Reward::of_step(double x, double angle, bool fell, const double* action) {
  constexpr double kTorqueCost = 0.00035 * kMotorTorque;
  double shaping = 130 * x / kScale;
  shaping -= 5.0 * std::abs(angle);
  float reward = previous_shaping_ ? static_cast<float>(shaping - *previous_shaping_) : 0.0F;
  previous_shaping_ = shaping;
  for (std::size_t i = 0; i < kJointCount; ++i) {
    const float effort = std::min(std::abs(static_cast<float>(action[i])), 1.0F);
    reward -= static_cast<float>(kTorqueCost) * effort;
  }
  return fell ? kFallReward : double{reward};
}

}  // namespace walker::bipedal_walker
