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
                              Policy policy, std::uint32_t most_steps = 2000) {
  const std::size_t action_size = twin.environment().specification().action_size();
  twin.reset(seed);
  walker_sim::Transition told = remote.reset(seed);
  EXPECT_TRUE(told.action.empty());
  EXPECT_TRUE(twin.equals(told));
  while (!twin.has_ended() && told.step < most_steps && !testing::Test::HasFailure()) {
    const std::vector<double> action = policy.act(twin.observation(), action_size);
    twin.step(action);
    told = remote.step(action);
    EXPECT_TRUE(twin.equals(told));
  }
  return told.step;
}

TEST(EpisodeBits, AreEqualForEveryPolicy) {
  Remote remote("/walker_sim");
  Twin twin("BipedalWalker-v3");
  std::uint32_t steps = 0;
  for (const Policy::Kind kind : Policy::kAll) {
    for (unsigned seed = 0; seed < 4; ++seed) {
      steps += compare_episode(remote, twin, seed, Policy(kind, seed));
    }
  }
  EXPECT_GT(steps, 2000U);
}

TEST(EpisodeBits, AreEqualHardcore) {
  Remote remote("/hardcore/walker_sim");
  Twin twin("BipedalWalkerHardcore-v3");
  for (const Policy::Kind kind : Policy::kAll) {
    compare_episode(remote, twin, 40 + kind, Policy(kind, kind));
  }
}

/// Plays episodes of all policies except the heuristic.
/// @return total number of steps
std::uint32_t compare_walker2d(const std::string& space, const std::string& id, unsigned seeds,
                               const Parameters& parameters = {}) {
  Remote remote(space + "/walker_sim");
  Twin twin(id, parameters);
  std::uint32_t steps = 0;
  for (const Policy::Kind kind : Policy::kAll) {
    if (kind == Policy::heuristic) continue;
    for (unsigned seed = 0; seed < seeds; ++seed) {
      steps += compare_episode(remote, twin, seed, Policy(kind, seed));
    }
  }
  return steps;
}

TEST(EpisodeBits, AreEqualOfWalker2d) {
  EXPECT_GT(compare_walker2d("/v4", "Walker2d-v4", 8), 500U);
  EXPECT_GT(compare_walker2d("/v5", "Walker2d-v5", 8), 500U);
}

/// The parameters are those of /other in episode_bits_test.test.
TEST(EpisodeBits, AreEqualOfWalker2dWithOtherParameters) {
  const Parameters parameters{{"frame_skip", std::int64_t{2}},
                              {"terminate_when_unhealthy", false},
                              {"ctrl_cost_weight", 0.1},
                              {"healthy_angle_range", std::vector<double>{-0.2, 0.3}},
                              {"reset_noise_scale", 0.1},
                              {"exclude_current_positions_from_observation", false},
                              {"max_episode_steps", std::int64_t{200}}};
  EXPECT_EQ(compare_walker2d("/other", "Walker2d-v5", 2, parameters), 2U * 5U * 200U);
}

TEST(EpisodeBits, AreEqualForSeedsOf64Bits) {
  Remote remote("/walker_sim");
  Twin twin("BipedalWalker-v3");
  for (const std::uint64_t seed : {std::numeric_limits<std::uint64_t>::max(),
                                   std::uint64_t{1} << 32, std::uint64_t{1} << 63}) {
    compare_episode(remote, twin, seed, Policy(Policy::random, 1));
  }
}

TEST(EpisodeBits, AreEqualWhereTheGeneratorContinues) {
  Remote remote("/walker_sim");
  Twin twin("BipedalWalker-v3");
  std::optional<std::uint64_t> seed = 17;
  for (unsigned episode = 0; episode < 6; ++episode) {
    compare_episode(remote, twin, seed, Policy(Policy::random, episode), 60);
    seed.reset();
  }
}

TEST(EpisodeBits, AreEqualInAWorldUsedAgain) {
  Remote remote("/reuse/walker_sim");
  Twin twin("BipedalWalker-v3", {{"reuse_world", true}});
  std::optional<std::uint64_t> seed = 18;
  for (unsigned episode = 0; episode < 6; ++episode) {
    compare_episode(remote, twin, seed, Policy(Policy::random, episode));
    seed.reset();
  }
}

/// The server has ~seed = 18446744073709551615, and no other test resets it.
TEST(EpisodeBits, TheSeedParameterServesTheFirstResetOnly) {
  Remote remote("/seeded/walker_sim");
  Twin twin("BipedalWalker-v3");
  twin.reset(std::numeric_limits<std::uint64_t>::max());
  EXPECT_TRUE(twin.equals(remote.reset(std::nullopt)));
  for (unsigned episode = 0; episode < 3; ++episode) {
    compare_episode(remote, twin, std::nullopt, Policy(Policy::random, episode), 50);
  }
}

TEST(EpisodeBits, ASeedTwiceGivesEqualTransitionsOver300Steps) {
  Remote remote("/walker_sim");
  bipedal_walker::Heuristic heuristic;
  std::vector<walker_sim::Transition> first{remote.reset(6)};
  for (int i = 0; i < 300; ++i) {
    std::vector<double> action(4);
    heuristic.act(first.back().observation.data(), action.data());
    first.push_back(remote.step(action));
    ASSERT_FALSE(first.back().terminated) << "this seed was to last";
  }
  remote.reset(123);  // an unrelated episode in between
  for (int i = 0; i < 20; ++i) remote.step({1, -1, 1, -1});
  walker_sim::Transition again = remote.reset(6);
  for (std::size_t i = 0; i < first.size(); ++i) {
    if (i > 0) again = remote.step(first[i].action);
    EXPECT_EQ(bits(again.observation), bits(first[i].observation));
    EXPECT_EQ(bits({again.reward, again.episode_return}),
              bits({first[i].reward, first[i].episode_return}));
    EXPECT_EQ(again.terminated, first[i].terminated);
    EXPECT_EQ(again.truncated, first[i].truncated);
    EXPECT_EQ(again.step, i);
  }
}

TEST(EpisodeBits, GeneratorStateIsThatBeforeTheReset) {
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

TEST(EpisodeBits, EpisodeTellsHowItEnded) {
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
