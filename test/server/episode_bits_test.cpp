// Episodes over ROS are bitwise equal to the same episodes in process.
#include <gtest/gtest.h>

#include <limits>
#include <random>

#include <ros/ros.h>

#include "base/random.h"
#include "robots/bipedal_walker/heuristic.h"
#include "server/inbox.h"
#include "server/remote.h"
#include "server/twin.h"
#include "walker_sim/Episode.h"

namespace walker::test {
namespace {

class Policy {
 public:
  enum Kind { heuristic, random, saturated, beyond_bounds, not_float32, zero };
  static constexpr Kind kAll[] = {heuristic, random, saturated, beyond_bounds, not_float32, zero};

  Policy(Kind kind, unsigned seed) : kind_(kind), draws_(seed) {}

  /// @param size of the action; `heuristic` is for BipedalWalker only
  std::vector<double> act(const std::vector<double>& observation, std::size_t size) {
    std::vector<double> action(size);
    if (kind_ == heuristic) {
      heuristic_.act(observation.data(), action.data());
      return action;
    }
    for (double& value : action) value = choose();
    return action;
  }

 private:
  double choose() {
    switch (kind_) {
      case random:
        return double{static_cast<float>(uniform_(draws_))};
      case saturated:
        return uniform_(draws_) < 0 ? -1 : 1;
      case beyond_bounds:
        return 3 * double{static_cast<float>(uniform_(draws_))};
      case not_float32:
        return uniform_(draws_);
      default:
        return 0;
    }
  }

  Kind kind_;
  std::mt19937 draws_;
  std::uniform_real_distribution<double> uniform_{-1, 1};
  bipedal_walker::Heuristic heuristic_;
};

/// @return length of the episode
std::uint32_t compare_episode(Remote& remote, Twin& twin, std::optional<std::uint64_t> seed,
                              Policy policy) {
  const std::size_t action_size = twin.environment().specification().action_size();
  twin.reset(seed);
  walker_sim::Transition received = remote.reset(seed);
  EXPECT_TRUE(received.action.empty());
  EXPECT_TRUE(twin.equals(received));
  while (!twin.has_ended() && received.step < 2000 && !testing::Test::HasFailure()) {
    const std::vector<double> action = policy.act(twin.observation(), action_size);
    twin.step(action);
    received = remote.step(action);
    EXPECT_TRUE(twin.equals(received));
  }
  return received.step;
}

/// A server in episode_bits_test.test.
struct Case {
  const char* space;
  const char* id;
  Parameters parameters;
  unsigned first_seed;
  unsigned num_seeds;       // per policy
  std::uint32_t min_steps;  // of all episodes together
};

class EveryPolicy : public testing::TestWithParam<Case> {};

TEST_P(EveryPolicy, GivesEqualEpisodes) {
  const Case& server = GetParam();
  Remote remote(server.space + std::string("/walker_sim"));
  Twin twin(server.id, server.parameters);
  std::uint32_t steps = 0;
  for (const Policy::Kind kind : Policy::kAll) {
    if (kind == Policy::heuristic && twin.environment().specification().action_size() != 4)
      continue;
    for (unsigned i = 0; i < server.num_seeds; ++i) {
      const unsigned seed = server.first_seed + i;
      steps += compare_episode(remote, twin, seed, Policy(kind, seed));
    }
  }
  EXPECT_GE(steps, server.min_steps);
}

INSTANTIATE_TEST_SUITE_P(
    Servers, EveryPolicy,
    testing::Values(Case{"", "BipedalWalker-v3", {}, 0, 4, 2000},
                    Case{"/hardcore", "BipedalWalkerHardcore-v3", {}, 40, 2, 0},
                    Case{"/v4", "Walker2d-v4", {}, 0, 8, 500},
                    Case{"/v5", "Walker2d-v5", {}, 0, 8, 500},
                    Case{"/other",
                         "Walker2d-v5",
                         {{"frame_skip", std::int64_t{2}},
                          {"terminate_when_unhealthy", false},
                          {"ctrl_cost_weight", 0.1},
                          {"healthy_angle_range", std::vector<double>{-0.2, 0.3}},
                          {"reset_noise_scale", 0.1},
                          {"exclude_current_positions_from_observation", false},
                          {"max_episode_steps", std::int64_t{200}}},
                         0,
                         2,
                         2 * 5 * 200}));

TEST(EpisodeBits, EqualFor64BitSeeds) {
  Remote remote("/walker_sim");
  Twin twin("BipedalWalker-v3");
  for (const std::uint64_t seed : {std::numeric_limits<std::uint64_t>::max(),
                                   std::uint64_t{1} << 32, std::uint64_t{1} << 63}) {
    compare_episode(remote, twin, seed, Policy(Policy::random, 1));
  }
}

TEST(EpisodeBits, EqualIfTheGeneratorContinues) {
  for (const bool reuses_world : {false, true}) {
    Remote remote(reuses_world ? "/reuse/walker_sim" : "/walker_sim");
    Twin twin("BipedalWalker-v3", {{"reuse_world", reuses_world}});
    std::optional<std::uint64_t> seed = 17;
    for (unsigned episode = 0; episode < 6; ++episode) {
      compare_episode(remote, twin, seed, Policy(Policy::random, episode));
      seed.reset();
    }
  }
}

TEST(EpisodeBits, EpisodeHasTheGeneratorStateBeforeTheReset) {
  ros::NodeHandle node;
  Remote remote("/walker_sim");
  Twin twin("BipedalWalker-v3");
  Inbox<walker_sim::Episode> episodes(node, "/episode");
  std::optional<std::uint64_t> seed = 99;
  for (int i = 0; i < 5; ++i) {
    const GeneratorState before =
        seed ? Generator(*seed).state() : twin.environment().generator_state();
    twin.reset(seed);
    const walker_sim::Transition begun = remote.reset(seed);
    const auto episode = episodes.at(begun.header.stamp);
    ASSERT_TRUE(episode) << "no message on /episode";
    EXPECT_EQ(episode->has_seed != 0, seed.has_value());
    EXPECT_EQ(episode->seed, seed.value_or(0));
    EXPECT_EQ(episode->length, 0U);
    for (std::size_t word = 0; word < before.size(); ++word) {
      EXPECT_EQ(episode->generator_state[word], before[word]) << "word " << word;
    }
    seed.reset();
  }
}

TEST(EpisodeBits, EpisodeHasReturnAndEndReason) {
  ros::NodeHandle node;
  Remote remote("/walker_sim");
  Twin twin("BipedalWalker-v3");
  Inbox<walker_sim::Episode> episodes(node, "/episode");
  compare_episode(remote, twin, 5, Policy(Policy::zero, 0));
  ASSERT_TRUE(twin.has_ended());
  const auto ended =
      episodes.find([](const walker_sim::Episode& message) { return message.length > 0; });
  ASSERT_TRUE(ended);
  EXPECT_EQ(bits({ended->episode_return}), bits({twin.episode_return()}));
  EXPECT_NE(ended->end_reason.find(twin.end_reason()), std::string::npos) << ended->end_reason;
}

}  // namespace
}  // namespace walker::test
