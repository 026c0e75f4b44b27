// Seeds, bounds of actions and the end of episodes.
#include <gtest/gtest.h>

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

TEST(Episodes, DependOnTheSeedAlone) {
  for (const char* id : {kPlain, kHardcore}) {
    for (std::uint64_t seed = 100; seed < 106; ++seed) {
      Stepper walker(id);
      const Rows fresh = play_fresh(id, seed);
      EXPECT_EQ(play_heuristic(walker, seed), fresh) << "in a new environment";
      play(walker, 1, Actions("random", 1), 200);
      play(walker, std::nullopt, Actions("noisy", 2));
      EXPECT_EQ(play_heuristic(walker, seed), fresh) << "after other episodes";
    }
  }
  EXPECT_NE(play_fresh(kPlain, 21), play_fresh(kPlain, 22));
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

TEST(Episodes, ClipsActions) {
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

TEST(Episodes, LimitDoesNotChangeTheSteps) {
  Stepper walker(kPlain, {{"max_episode_steps", std::int64_t{50}}});
  const Rows limited = play_heuristic(walker, 0);
  const Rows whole = play_fresh(kPlain, 0);
  ASSERT_EQ(limited.size(), 51U);
  EXPECT_TRUE(walker.result.truncated);
  EXPECT_STREQ(walker.result.end_reason, "50 steps");
  for (std::size_t i = 0; i < 50; ++i) EXPECT_EQ(limited[i], whole[i]);
}

TEST(Episodes, HardcoreIsAParameterToo) {
  Stepper by_parameter(kPlain, {{"hardcore", true}});
  EXPECT_EQ(play_heuristic(by_parameter, 4), play_fresh(kHardcore, 4));
}

}  // namespace
}  // namespace walker::bipedal_walker
