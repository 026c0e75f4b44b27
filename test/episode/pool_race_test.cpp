// Pools under ThreadSanitizer, which fails the program on a data race. Episodes are short, so that
// one thread often resets an environment while other threads step others.
#include <gtest/gtest.h>

#include "episode/rollout.h"

namespace walker {
namespace {

constexpr std::size_t kCount = 6;
constexpr int kRounds = 60;

class PoolRaceTest : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override { rollout_.reset(0); }

  std::mt19937 random_{1};
  Rollout rollout_{GetParam(),
                   {kCount, 3, AutoresetMode::same_step, 2},
                   {{"max_episode_steps", std::int64_t{12}}}};
};

TEST_P(PoolRaceTest, StepsWithoutARace) {
  rollout_.play(random_, kRounds);
  for (const std::uint32_t episode : rollout_.arrays.episodes) EXPECT_GE(episode, kRounds / 12);
}

TEST_P(PoolRaceTest, SendsAndReceivesWithoutARace) {
  Pool& pool = rollout_.pool;
  pool.send_resets({});
  std::vector<std::uint32_t> environments(2);
  for (int i = 0; i < 3 * kRounds; ++i) {
    pool.recv(rollout_.arrays.batch(), environments.data());
    const std::vector<double> actions = rollout_.draw_actions(random_, 2);
    pool.send(actions.data(), environments.data(), 2);
  }
  EXPECT_GT(rollout_.arrays.episodes[0], 1U);
}

INSTANTIATE_TEST_SUITE_P(BothEngines, PoolRaceTest,
                         testing::Values("BipedalWalker-v3", "BipedalWalkerHardcore-v3",
                                         "Walker2d-v5"));

}  // namespace
}  // namespace walker
