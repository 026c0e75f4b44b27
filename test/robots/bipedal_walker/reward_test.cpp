#include "robots/bipedal_walker/reward.h"

#include <gtest/gtest.h>

namespace walker::bipedal_walker {
namespace {

constexpr double kNoTorque[4] = {0, 0, 0, 0};

TEST(Reward, FirstStepHasNothingToCompareWith) {
  Reward reward;
  EXPECT_EQ(reward.of_step(7, 0.5, false, kNoTorque), 0);
}

TEST(Reward, PaysTheWayAndChargesTheTilt) {
  Reward reward;
  reward.of_step(4, 0.2, false, kNoTorque);
  EXPECT_NEAR(reward.of_step(7, 0.2, false, kNoTorque), 3 * 130 / 30.0, 1e-5);
  EXPECT_NEAR(reward.of_step(7, -0.2, false, kNoTorque), 0, 1e-5) << "either side counts alike";
  EXPECT_NEAR(reward.of_step(7, -0.5, false, kNoTorque), -5 * 0.3, 1e-5);
  EXPECT_NEAR(reward.of_step(7, 0.1, false, kNoTorque), 5 * 0.4, 1e-5);
}

TEST(Reward, ChargesTorqueUpToItsLimit) {
  Reward reward;
  const double action[4] = {0.5, -1, 3, -200};
  EXPECT_NEAR(reward.of_step(7, 0, false, action), -0.028 * 3.5, 1e-6);
}

TEST(Reward, AFallCostsAHundredWhateverElse) {
  Reward reward;
  const double action[4] = {1, 1, 1, 1};
  reward.of_step(4, 0, false, action);
  EXPECT_EQ(reward.of_step(9, 0, true, action), -100);
}

TEST(Reward, RestartForgets) {
  Reward reward;
  reward.of_step(4, 0, false, kNoTorque);
  reward.restart();
  EXPECT_EQ(reward.of_step(9, 0, false, kNoTorque), 0);
}

/// The costs are subtracted one by one in single precision from the rounded progress.
TEST(Reward, RoundsToSinglePrecision) {
  Reward reward;
  const double action[4] = {0.3F, 0.3F, 0.3F, 0.3F};
  reward.of_step(4, 0, false, kNoTorque);
  auto expected = static_cast<float>(130 * 4.1 / 30 - 130 * 4.0 / 30);
  for (int i = 0; i < 4; ++i) expected -= 0.028F * 0.3F;
  EXPECT_EQ(reward.of_step(4.1, 0, false, action), double{expected});
}

}  // namespace
}  // namespace walker::bipedal_walker
