// The gait walks, in both versions and from every start.
#include "walker2d/gait.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "stepper.h"

namespace walker::walker2d {
namespace {

class GaitTest : public testing::TestWithParam<const char*> {};

TEST_P(GaitTest, WalksThroughWholeEpisodes) {
  constexpr std::uint64_t kSeeds = 40;
  constexpr int kMayFall = 2;
  constexpr int kSteps = 1000;
  Stepper walker(GetParam());
  mujoco::LinearGait gait(walker2d::gait(), walker.environment->specification());
  int falls = 0;
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    walker.reset(seed);
    int steps = 0;
    for (; !walker.has_ended(); ++steps) {
      walker.step(gait.act(walker.observation));
    }
    if (steps < kSteps) {
      ++falls;
      continue;
    }
    EXPECT_GT(walker.info[0], 15) << "of metres forward, seed " << seed;
  }
  EXPECT_LE(falls, kMayFall);
}

INSTANTIATE_TEST_SUITE_P(Versions, GaitTest, testing::Values("Walker2d-v4", "Walker2d-v5"),
                         [](const auto& version) { return std::string(version.param).substr(9); });

TEST(Gait, ActionsAreSinglesWithinTheBounds) {
  const Stepper walker("Walker2d-v5");
  const Specification& specification = walker.environment->specification();
  mujoco::LinearGait gait(walker2d::gait(), specification);
  for (const double value : {0.0, 0.1, -10.0, 10.0, 1e300}) {
    const std::vector<double> observation(specification.observation_size(), value);
    for (const double element : gait.act(observation)) {
      EXPECT_EQ(element, double{static_cast<float>(element)});
      EXPECT_LE(std::abs(element), 1);
    }
  }
}

}  // namespace
}  // namespace walker::walker2d
