// Determinism, seeds, invalid actions and the end of episodes.
#include <gtest/gtest.h>

#include <limits>
#include <thread>

#include "robots/bipedal_walker/player.h"

namespace walker::bipedal_walker {
namespace {

using Rows = std::vector<std::vector<double>>;

constexpr const char* kPlain = "BipedalWalker-v3";
constexpr const char* kHardcore = "BipedalWalkerHardcore-v3";

Rows play_heuristic(Stepper& walker, std::optional<std::uint64_t> seed) {
  return play(walker, seed, Actions("heuristic", 0));
}

Rows play_fresh(const char* id, std::uint64_t seed) {
  Stepper walker(id);
  return play_heuristic(walker, seed);
}

/// Returns how many of 12 seeded episodes differ from a fresh environment's if others precede them.
int count_differing(bool reuse_world) {
  int differing = 0;
  for (const char* id : {kPlain, kHardcore}) {
    for (std::uint64_t seed = 100; seed < 106; ++seed) {
      Stepper walker(id, {{"reuse_world", reuse_world}});
      const Rows fresh = play_fresh(id, seed);
      EXPECT_EQ(play_heuristic(walker, seed), fresh) << "nothing went before";
      play(walker, 1, Actions("random", 1), 200);
      play(walker, std::nullopt, Actions("noisy", 2));
      differing += play_heuristic(walker, seed) == fresh ? 0 : 1;
    }
  }
  return differing;
}

TEST(Episodes, SameSeedSameTrajectoryWhateverWentBefore) {
  EXPECT_EQ(count_differing(false), 0);
  EXPECT_NE(play_fresh(kPlain, 21), play_fresh(kPlain, 22));
}

/// b2World keeps state between episodes, so by default each episode gets a new one.
TEST(Episodes, ReusedWorldsMakeLaterEpisodesDiffer) { EXPECT_GT(count_differing(true), 0); }

TEST(Episodes, WithoutASeedTheGeneratorContinues) {
  Stepper walker(kPlain);
  Stepper twin(kPlain);
  EXPECT_EQ(walker.environment->generator_state(), GeneratorState{});
  const Rows first = play_heuristic(walker, 8);
  const GeneratorState between = walker.environment->generator_state();
  const Rows second = play_heuristic(walker, std::nullopt);
  EXPECT_NE(second, first);
  EXPECT_EQ(play_heuristic(twin, 8), first);
  EXPECT_EQ(twin.environment->generator_state(), between);
  EXPECT_EQ(play_heuristic(twin, std::nullopt), second);
}

TEST(Episodes, FirstResetWithoutASeedDrawsOne) {
  Stepper walker(kPlain);
  Stepper other(kPlain);
  walker.reset();
  other.reset();
  EXPECT_NE(walker.environment->generator_state(), GeneratorState{});
  EXPECT_NE(walker.environment->generator_state(), other.environment->generator_state());
}

TEST(Episodes, ResetReportsNoRewardAndNoEnd) {
  Stepper walker(kPlain);
  play(walker, 1, Actions("zero", 0));
  ASSERT_TRUE(walker.result.terminated);
  EXPECT_EQ(walker.result.reward, -100);
  EXPECT_STREQ(walker.result.end_reason, "hull touched the ground");
  walker.reset();
  EXPECT_FALSE(walker.has_ended());
  EXPECT_EQ(walker.result.reward, 0);
  EXPECT_STREQ(walker.result.end_reason, "");
  EXPECT_STREQ(walker.result.error, "");
}

TEST(Episodes, RefusedActionsLeaveNoTrace) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Stepper walker(kPlain);
  Stepper twin(kPlain);
  walker.reset(3);
  twin.reset(3);
  for (int i = 0; i < 20; ++i) {
    const std::vector<double> before = walker.observation;
    EXPECT_THROW(walker.step({0, kNan, 0, 0}), InvalidAction);
    EXPECT_THROW(walker.step({0, 0, 0, kInfinity}), InvalidAction);
    EXPECT_THROW(walker.step({1, 1, 1}), InvalidAction);
    EXPECT_THROW(walker.step({1, 1, 1, 1, 1}), InvalidAction);
    EXPECT_EQ(walker.observation, before);
    walker.step({0.5, -1, 1, 0.25});
    twin.step({0.5, -1, 1, 0.25});
    ASSERT_EQ(walker.row(), twin.row()) << "step " << i;
  }
}

TEST(Episodes, ActionsBeyondTheBoundsActAsTheBounds) {
  Stepper walker(kPlain);
  Stepper twin(kPlain);
  walker.reset(3);
  twin.reset(3);
  for (int i = 0; i < 40; ++i) {
    walker.step({1e300, -7, 1.5, -1.0000001});
    twin.step({1, -1, 1, -1});
    ASSERT_EQ(walker.row(), twin.row()) << "step " << i;
  }
}

/// Lengths of the episodes that do not terminate; some random walkers never fall.
std::vector<std::size_t> lengths_of_the_untiring(const char* id, const Parameters& parameters,
                                                 std::size_t most_steps) {
  std::vector<std::size_t> lengths;
  for (std::uint64_t seed = 0; seed < 12; ++seed) {
    Stepper walker(id, parameters);
    const Rows rows = play(walker, seed, Actions("random", seed), most_steps);
    if (!walker.result.terminated) lengths.push_back(rows.size() - 1);
  }
  return lengths;
}

TEST(Episodes, TheLimitTruncatesOnItsVeryStep) {
  const auto expect_all = [](const std::vector<std::size_t>& lengths, std::size_t expected) {
    EXPECT_GE(lengths.size(), 1U);
    for (const std::size_t length : lengths) EXPECT_EQ(length, expected);
  };
  expect_all(lengths_of_the_untiring(kPlain, {}, 3000), 1600);
  expect_all(lengths_of_the_untiring(kHardcore, {}, 3000), 2000);
  expect_all(lengths_of_the_untiring(kPlain, {{"hardcore", true}}, 3000), 1600);
  expect_all(lengths_of_the_untiring(kPlain, {{"max_episode_steps", std::int64_t{7}}}, 3000), 7);
  expect_all(lengths_of_the_untiring(kPlain, {{"max_episode_steps", std::int64_t{0}}}, 3000), 3000);
}

TEST(Episodes, ALimitDoesNotChangeTheSteps) {
  Stepper walker(kPlain, {{"max_episode_steps", std::int64_t{50}}});
  const Rows limited = play_heuristic(walker, 0);
  const Rows whole = play_fresh(kPlain, 0);
  ASSERT_EQ(limited.size(), 51U);
  EXPECT_TRUE(walker.result.truncated);
  EXPECT_STREQ(walker.result.end_reason, "50 steps");
  for (std::size_t i = 0; i < 50; ++i) EXPECT_EQ(limited[i], whole[i]);
}

TEST(Episodes, HardcoreIsTheParameterToo) {
  Stepper by_parameter(kPlain, {{"hardcore", true}});
  EXPECT_EQ(play_heuristic(by_parameter, 4), play_fresh(kHardcore, 4));
}

TEST(Episodes, WalkersDoNotDisturbEachOther) {
  const Rows alone = play_fresh(kPlain, 0);
  Rows in_threads[2];
  std::thread first([&] { in_threads[0] = play_fresh(kPlain, 0); });
  std::thread second([&] { in_threads[1] = play_fresh(kPlain, 0); });
  first.join();
  second.join();
  EXPECT_EQ(in_threads[0], alone);
  EXPECT_EQ(in_threads[1], alone);
}

}  // namespace
}  // namespace walker::bipedal_walker
