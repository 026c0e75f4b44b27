#include "robots/mujoco/locomotion_robot.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "robots/mujoco/player.h"
#include "stepper.h"

namespace walker::mujoco {
namespace {

constexpr double kNoAction[kJointCount] = {};

RewardOptions options(bool is_v5) { return {1.0, 1e-3, 1.0, true, is_v5}; }

/// Gymnasium adds forward and survive first; another order rounds differently.
TEST(Reward, AddsInGymnasiumsOrder) {
  const RewardTerms terms{1e16, -1e16, 1};
  EXPECT_EQ(terms.total(), 0);
  EXPECT_EQ((RewardTerms{1, -1e16, 1e16}).total(), 0);
}

/// Costs are NumPy 2's `weight * numpy.sum(numpy.square(action))` for float32 actions, not clamped.
TEST(Reward, CostEqualsNumPys) {
  struct Case {
    double weight;
    double action[kJointCount];
    double cost;
  };
  const Case cases[] = {
      {1e-3, {0.1F, -0.2F, 0.3F, 0.7F, -0.9F, 1.0F}, 0x1.3fd0d2p-9},
      {1e-3, {1.3F, -2.9F, 0.01F, 1e-20F, 3e-23F, 0.5F}, 0x1.5326fp-7},
      {0.37, {0.1F, 0.1F, 0.1F, 0.1F, 0.1F, 0.1F}, 0x1.6bb99p-6},
      {-2.5, {0.123F, 0.456F, 0.789F, -0.321F, -0.654F, -0.987F}, -0x1.7814f8p+2}};
  for (const Case& expected : cases) {
    RewardOptions weighted = options(true);
    weighted.ctrl_cost_weight = expected.weight;
    EXPECT_EQ(reward_of_step(weighted, 0, true, expected.action, kJointCount).control,
              -expected.cost);
  }
}

/// Gymnasium's cost would be infinite, or NaN with a weight of 0.
TEST(Reward, StaysFiniteForTheLargestActions) {
  constexpr double kMaxCost = std::numeric_limits<float>::max();
  for (const double huge : {1e19, 1e30, 1e300, -std::numeric_limits<double>::max()}) {
    const double action[kJointCount] = {0, huge, 0, huge, 0, 0};
    RewardOptions weighted = options(true);
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
  RewardOptions penal = options(true);
  penal.healthy_reward = -1;
  const RewardTerms terms = reward_of_step(penal, -0.0, false, kNoAction, kJointCount);
  EXPECT_TRUE(std::signbit(terms.control));
  EXPECT_TRUE(std::signbit(terms.survive));
  EXPECT_TRUE(std::signbit(terms.forward));
  EXPECT_TRUE(std::signbit(terms.total()));
  EXPECT_FALSE(
      std::signbit(reward_of_step(options(true), -0.0, false, kNoAction, kJointCount).survive));
  EXPECT_FALSE(
      std::signbit(reward_of_step(options(true), -0.0, false, kNoAction, kJointCount).total()));
  RewardOptions rewarding = options(true);
  rewarding.ctrl_cost_weight = -1;
  EXPECT_FALSE(std::signbit(reward_of_step(rewarding, 0, true, kNoAction, kJointCount).control));
}

TEST(Reward, SurvivalDependsOnTheVersion) {
  for (const bool is_v5 : {false, true}) {
    for (const bool terminates : {false, true}) {
      for (const bool is_healthy : {false, true}) {
        RewardOptions chosen = options(is_v5);
        chosen.terminate_when_unhealthy = terminates;
        const double expected = is_healthy || (!is_v5 && terminates) ? 1 : 0;
        EXPECT_EQ(reward_of_step(chosen, 0, is_healthy, kNoAction, kJointCount).survive, expected)
            << is_v5 << terminates << is_healthy;
      }
    }
  }
}

/// v4 and v5 on one model have the same episodes, except for the reward of the terminating step.
TEST(Versions, DifferInTheStepThatEndsTheEpisode) {
  for (const bool terminates : {true, false}) {
    Stepper v4("Walker2d-v4",
               {{"terminate_when_unhealthy", terminates}, {"max_episode_steps", 400.0}});
    Stepper v5("Walker2d-v5", {{"terminate_when_unhealthy", terminates},
                               {"max_episode_steps", 400.0},
                               {"xml_file", std::string("walker2d_v4.xml")}});
    v4.reset(3);
    v5.reset(3);
    EXPECT_EQ(v4.observation, v5.observation);
    int steps = 0;
    for (; !v5.has_ended(); ++steps) {
      v4.step({0.5, -0.25, 1, -1, 0, 0});
      v5.step({0.5, -0.25, 1, -1, 0, 0});
      ASSERT_EQ(v4.observation, v5.observation);
      EXPECT_EQ(v4.info, (std::vector<double>{v5.info[0], v5.info[2]}));
      const double forward = v5.info[3];
      const double control = v5.info[4];
      const double survive = v5.info[5];
      EXPECT_EQ(v5.result.reward, forward + survive + control);
      EXPECT_EQ(v4.result.reward, forward + (v5.result.terminated ? 1 : survive) + control);
    }
    EXPECT_EQ(v5.result.terminated, terminates);
    EXPECT_EQ(v5.info[5], 0) << "fallen";
    EXPECT_EQ(v4.result.terminated, v5.result.terminated);
    EXPECT_EQ(steps == 400, !terminates);
  }
}

}  // namespace
}  // namespace walker::mujoco
