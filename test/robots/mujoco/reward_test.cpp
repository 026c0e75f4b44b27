// Rewards at the ends of their range, and the signs of zeros. recordings_test.cpp has the others.
#include "robots/mujoco/locomotion_robot.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "robots/mujoco/player.h"

namespace walker::mujoco {
namespace {

constexpr double kNoAction[kJointCount] = {};

const RewardOptions kOptions{1.0, 1e-3, 1.0, true, true};

/// Gymnasium's cost would be infinite, or NaN with a weight of 0.
TEST(Reward, StaysFiniteForTheLargestActions) {
  constexpr double kMaxCost = std::numeric_limits<float>::max();
  for (const double huge : {1e19, 1e30, 1e300, -std::numeric_limits<double>::max()}) {
    const double action[kJointCount] = {0, huge, 0, huge, 0, 0};
    RewardOptions weighted = kOptions;
    for (const double weight : {0.0, 1e-3, 1e9, -1e9}) {
      weighted.ctrl_cost_weight = weight;
      const double control = reward_of_step(weighted, 0, true, action, kJointCount).control;
      EXPECT_TRUE(std::isfinite(control)) << huge << " " << weight;
      EXPECT_LE(std::abs(control), kMaxCost);
      EXPECT_EQ(control<0, weight> 0) << "a cost is a cost";
    }
  }
}

/// The signs are Python's: -0.0 for zero actions, and for False times a negative number.
TEST(Reward, KeepsTheSignOfZero) {
  RewardOptions penal = kOptions;
  penal.healthy_reward = -1;
  const RewardTerms terms = reward_of_step(penal, -0.0, false, kNoAction, kJointCount);
  EXPECT_TRUE(std::signbit(terms.control));
  EXPECT_TRUE(std::signbit(terms.survive));
  EXPECT_TRUE(std::signbit(terms.forward));
  EXPECT_TRUE(std::signbit(terms.total()));
  const RewardTerms usual = reward_of_step(kOptions, -0.0, false, kNoAction, kJointCount);
  EXPECT_FALSE(std::signbit(usual.survive));
  EXPECT_FALSE(std::signbit(usual.total()));
  RewardOptions rewarding = kOptions;
  rewarding.ctrl_cost_weight = -1;
  EXPECT_FALSE(std::signbit(reward_of_step(rewarding, 0, true, kNoAction, kJointCount).control));
}

}  // namespace
}  // namespace walker::mujoco
