#include "robots/bipedal_walker/heuristic.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "recording.h"

namespace walker::bipedal_walker {
namespace {

constexpr std::size_t kActionSize = 4;
constexpr std::size_t kObservationSize = 24;

std::vector<double> next_floats(Recording& recording, std::size_t count) {
  std::vector<double> numbers(count);
  for (double& number : numbers) number = recording.next_float();
  return numbers;
}

TEST(Heuristic, ActsAsGymnasiumsOnWholeEpisodes) {
  Recording recording("full_episodes.txt");
  std::size_t compared = 0;
  while (recording.has_more()) {
    const auto word = recording.next<std::string>();
    if (word == "session") {
      recording.next<std::string>();
      recording.next<int>();
      continue;
    }
    const auto kind = recording.next<std::string>();
    recording.next<std::string>();
    recording.next<std::string>();
    const auto steps = recording.next<std::size_t>();
    Heuristic heuristic;
    std::vector<double> action(kActionSize, 0);
    for (std::size_t i = 0; i <= steps; ++i) {
      const std::vector<double> expected = next_floats(recording, kActionSize);
      for (std::size_t k = 0; k < kActionSize && kind == "heuristic"; ++k) {
        ASSERT_EQ(to_bits(action[k]), to_bits(expected[k])) << "step " << i << ", joint " << k;
        ++compared;
      }
      heuristic.act(next_floats(recording, kObservationSize).data(), action.data());
      next_floats(recording, 1);  // reward
      recording.next<int>();      // terminated
      recording.next<int>();      // truncated
    }
  }
  EXPECT_GT(compared, 10000U);
}

TEST(Heuristic, StartsAnewWithANewObject) {
  std::vector<double> observation(kObservationSize, 0.05);
  std::vector<double> first(kActionSize);
  std::vector<double> later(kActionSize);
  Heuristic used;
  used.act(observation.data(), first.data());
  for (int i = 0; i < 5; ++i) used.act(observation.data(), later.data());
  EXPECT_NE(first, later) << "it has a memory";
  Heuristic fresh;
  fresh.act(observation.data(), later.data());
  EXPECT_EQ(first, later);
}

TEST(Heuristic, ActionsStayWithinTheBounds) {
  std::vector<double> observation(kObservationSize, 100);
  std::vector<double> action(kActionSize);
  Heuristic heuristic;
  heuristic.act(observation.data(), action.data());
  for (const double value : action) EXPECT_EQ(std::abs(value), 1.0);
}

}  // namespace
}  // namespace walker::bipedal_walker
