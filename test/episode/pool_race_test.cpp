// Pools under ThreadSanitizer, which fails the program on a data race. Episodes are short, so that
// one thread often resets an environment while other threads step others.
#include <gtest/gtest.h>

#include "base/random.h"
#include "episode/pool_arrays.h"
#include "walker_sim/registry.h"

namespace walker {
namespace {

constexpr std::size_t kCount = 6;
constexpr int kRounds = 60;

class PoolRaceTest : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override { pool_.reset({}, {}, arrays_.batch()); }

  static PoolOptions options() {
    PoolOptions options;
    options.num_envs = kCount;
    options.num_threads = 3;
    options.autoreset_mode = AutoresetMode::same_step;
    options.batch_size = 2;
    return options;
  }

  std::vector<double> draw_actions(std::size_t count) {
    std::vector<double> actions(count * pool_.specification().action_size());
    for (double& value : actions) value = generator_.uniform(-1, 1);
    return actions;
  }

  Generator generator_{1};
  Pool pool_{[] { return make(GetParam(), {{"max_episode_steps", std::int64_t{12}}}); }, options()};
  PoolArrays arrays_{pool_.specification(), kCount};
};

TEST_P(PoolRaceTest, StepsWithoutARace) {
  for (int i = 0; i < kRounds; ++i) {
    const std::vector<double> actions = draw_actions(kCount);
    pool_.step(actions.data(), actions.size(), arrays_.batch());
  }
  for (const std::uint32_t episode : arrays_.episodes) EXPECT_GE(episode, kRounds / 12);
}

TEST_P(PoolRaceTest, SendsAndReceivesWithoutARace) {
  pool_.send_resets({});
  std::vector<std::uint32_t> environments(2);
  for (int i = 0; i < 3 * kRounds; ++i) {
    pool_.recv(arrays_.batch(), environments.data());
    pool_.send(draw_actions(2).data(), environments.data(), 2);
  }
  EXPECT_GT(arrays_.episodes[0], 1U);
}

INSTANTIATE_TEST_SUITE_P(BothEngines, PoolRaceTest,
                         testing::Values("BipedalWalker-v3", "BipedalWalkerHardcore-v3",
                                         "Walker2d-v5"));

}  // namespace
}  // namespace walker
