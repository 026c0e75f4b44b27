#include "robots/bipedal_walker/reward.h"

#include <gtest/gtest.h>

#include <array>

namespace walker::bipedal_walker {
namespace {

struct Case {
  const char* name;
  double x_before, angle_before, x, angle;
  bool fell;
  std::array<double, 4> action;
  double reward;
};

TEST(Reward, OfAStep) {
  constexpr std::array<double, 4> kNone{};
  for (const Case& step :
       {Case{"progress", 4, 0.2, 7, 0.2, false, kNone, 3 * 130 / 30.0},
        Case{"tilt to the other side", 7, 0.2, 7, -0.2, false, kNone, 0},
        Case{"more tilt", 7, -0.2, 7, -0.5, false, kNone, -5 * 0.3},
        Case{"less tilt", 7, -0.5, 7, 0.1, false, kNone, 5 * 0.4},
        Case{"torques up to the limit", 7, 0, 7, 0, false, {0.5, -1, 3, -200}, -0.028 * 3.5},
        Case{"a fall", 4, 0, 9, 0, true, {1, 1, 1, 1}, -100}}) {
    Reward reward;
    reward.of_step(step.x_before, step.angle_before, false, kNone.data());
    EXPECT_NEAR(reward.of_step(step.x, step.angle, step.fell, step.action.data()), step.reward,
                1e-5)
        << step.name;
    reward.restart();
    EXPECT_EQ(reward.of_step(step.x, step.angle, false, kNone.data()), 0) << "no previous step";
  }
}

}  // namespace
}  // namespace walker::bipedal_walker
