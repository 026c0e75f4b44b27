// The heuristic agent's gaits for Walker2d and Hopper.
#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "error_message.h"
#include "stepper.h"
#include "test_name.h"
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

TEST_P(GaitTest, ActionsAreFloatsWithinTheBounds) {
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

TEST_P(GaitTest, NeedsObservationsWithoutX) {
  const std::string id = GetParam();
  const auto environment = make(id, {{"exclude_current_positions_from_observation", false}});
  EXPECT_EQ(
      message_of<std::invalid_argument>(
          [&] { make_agent("heuristic", environment->specification(), 0); }),
      "agent = heuristic: needs " + id + " with exclude_current_positions_from_observation = true");
}

TEST_P(GaitTest, IgnoresTheLidar) {
  const auto plain = make(GetParam());
  const auto walker = make(GetParam(), {{"include_lidar_in_observation", true}});
  const auto gait = make_agent("heuristic", walker->specification(), 0);
  std::vector<double> observation(plain->specification().observation_size(), 0.1);
  const std::vector<double> action =
      make_agent("heuristic", plain->specification(), 0)->act(observation);
  observation.resize(walker->specification().observation_size(), 0.7);
  EXPECT_EQ(gait->act(observation), action);
}

/// Pins the weights, because a gait with a slightly different weight may walk as well. Each motor
/// is within its bounds at one of these heights, so that every weight matters.
TEST_P(GaitTest, HasTheTrainedWeights) {
  const std::map<double, std::vector<float>> of_walker2d{
      {0.25, {-0.210025266F, -0.0464313887F, -1, -1, -0.148415551F, -1}},
      {1.5, {-1, -1, 0.605275571F, -0.909228504F, -1, -0.0145301549F}}};
  const std::map<double, std::vector<float>> of_hopper{
      {0.75, {-0.500911534F, 0.0183059126F, -0.280177712F}}};
  const std::string id = GetParam();
  const auto environment = make(id);
  const auto gait = make_agent("heuristic", environment->specification(), 0);
  std::vector<double> observation(environment->specification().observation_size());
  for (std::size_t i = 1; i < observation.size(); ++i) {
    observation[i] = (i % 2 == 0 ? 0.01 : -0.01) * static_cast<double>(i + 1);
  }
  for (const auto& [height, expected] : id[0] == 'H' ? of_hopper : of_walker2d) {
    observation[0] = height;
    const std::vector<double> action = gait->act(observation);
    EXPECT_EQ(std::vector<float>(action.begin(), action.end()), expected) << "height " << height;
  }
}

INSTANTIATE_TEST_SUITE_P(Ids, GaitTest,
                         testing::Values("Walker2d-v4", "Walker2d-v5", "Hopper-v4", "Hopper-v5"),
                         kNameOfId);

}  // namespace
}  // namespace walker::mujoco
