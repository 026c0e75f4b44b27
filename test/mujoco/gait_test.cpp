// The gaits walk, in both versions and from every start.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include "error_message.h"
#include "stepper.h"
#include "walker_sim/agent.h"

namespace walker::mujoco {
namespace {

class GaitTest : public testing::TestWithParam<const char*> {};

TEST_P(GaitTest, WalksThroughWholeEpisodes) {
  constexpr std::uint64_t kSeeds = 40;
  constexpr int kMayFall = 2;
  constexpr int kSteps = 1000;
  Stepper walker(GetParam());
  const auto gait = make_agent("heuristic", walker.environment->specification(), 0);
  int falls = 0;
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    walker.reset(seed);
    int steps = 0;
    for (; !walker.has_ended(); ++steps) walker.step(gait->act(walker.observation));
    if (steps < kSteps) {
      ++falls;
      continue;
    }
    EXPECT_GT(walker.info[0], 15) << "of metres forward, seed " << seed;
  }
  EXPECT_LE(falls, kMayFall);
}

TEST_P(GaitTest, ActionsAreSinglesWithinTheBounds) {
  const auto environment = make(GetParam());
  const Specification& specification = environment->specification();
  const auto gait = make_agent("heuristic", specification, 0);
  for (const double value : {0.0, 0.1, -10.0, 10.0, 1e300}) {
    const std::vector<double> observation(specification.observation_size(), value);
    for (const double element : gait->act(observation)) {
      EXPECT_EQ(element, double{static_cast<float>(element)});
      EXPECT_LE(std::abs(element), 1);
    }
  }
}

TEST_P(GaitTest, IsForObservationsWithoutTheTrunksX) {
  const std::string id = GetParam();
  const auto environment = make(id, {{"exclude_current_positions_from_observation", false}});
  EXPECT_EQ(
      message_of<std::invalid_argument>(
          [&] { make_agent("heuristic", environment->specification(), 0); }),
      "agent = heuristic: needs " + id + " with exclude_current_positions_from_observation = true");
}

INSTANTIATE_TEST_SUITE_P(Ids, GaitTest,
                         testing::Values("Walker2d-v4", "Walker2d-v5", "Hopper-v4", "Hopper-v5"),
                         [](const auto& id) {
                           std::string name = id.param;
                           return name.erase(name.find('-'), 1);
                         });

}  // namespace
}  // namespace walker::mujoco
