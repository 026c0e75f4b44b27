// Whole episodes: the same bits as single steps, whatever else is played, and errors that name
// their cause.
#include "walker_sim/episode_player.h"

#include <gtest/gtest.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <memory>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "base/random.h"
#include "episode/fake_robot.h"
#include "episode/walker.h"
#include "error_message.h"
#include "policy/policy_bytes.h"
#include "stepper.h"
#include "walker_sim/registry.h"

namespace walker {
namespace {

using Outcomes = std::vector<PlayedEpisode>;

Policy shipped(const std::string& id) {
  return Policy(std::string(WALKER_SIM_SOURCE_DIR "/assets/policies/") + id + ".safetensors");
}

/// A policy whose parameters are a little off.
Policy changed(const Policy& policy, float by) {
  std::vector<float> parameters = policy.parameters();
  for (std::size_t i = 0; i < parameters.size(); i += 7) parameters[i] += by;
  return policy.with_parameters(parameters);
}

Outcomes play(EpisodePlayer& player, const std::vector<const Policy*>& policies,
              const std::vector<World>& worlds, const std::vector<EpisodeJob>& jobs) {
  Outcomes outcomes(jobs.size());
  std::vector<int> counts(jobs.size());
  player.play(policies, worlds, jobs, [&](std::size_t job, const PlayedEpisode& episode) {
    outcomes.at(job) = episode;
    ++counts.at(job);
  });
  EXPECT_EQ(counts, std::vector<int>(jobs.size(), 1));
  return outcomes;
}

auto fields(const PlayedEpisode& one) {
  return std::tie(one.episode_return, one.length, one.terminated, one.truncated, one.reward,
                  one.end_reason, one.error, one.world);
}

/// Plays one episode step by step.
PlayedEpisode stepped(const std::string& id, Policy& policy, std::uint64_t seed,
                      const World& world) {
  Stepper walker(id);
  const Specification& specification = walker.environment->specification();
  walker.environment->set_world(world);
  PlayedEpisode played;
  played.observation_sums.resize(walker.observation.size());
  played.observation_squares.resize(walker.observation.size());
  std::vector<double> action(specification.action_size());
  PolicyInput input(policy);
  walker.reset(seed);
  played.world = walker.environment->drawn_world();
  while (!walker.has_ended()) {
    for (std::size_t i = 0; i < walker.observation.size(); ++i) {
      double& value = walker.observation[i];
      if (specification.observation_dtype == "float32") value = static_cast<float>(value);
      played.observation_sums[i] += value;
      played.observation_squares[i] += value * value;
    }
    policy.act(walker.observation.data(), input, action.data());
    walker.step(action);
    played.episode_return += walker.result.reward;
    ++played.length;
  }
  played.info = walker.info;
  played.terminated = walker.result.terminated;
  played.truncated = walker.result.truncated;
  played.reward = walker.result.reward;
  played.end_reason = walker.result.end_reason;
  return played;
}

/// A linear policy that remembers, with random weights.
Policy remembering(const std::string& id) {
  const Specification specification = make(id)->specification();
  const std::size_t actions = specification.action_size();
  const std::size_t inputs = 3 * specification.observation_size() + 2 * actions;
  Generator random(1);
  std::vector<double> weight(actions * inputs);
  for (double& value : weight) value = random.uniform(-0.1, 0.1);
  PolicyBytes written = small_policy();
  written.metadata["history.observations"] = "3";
  written.metadata["history.actions"] = "2";
  written.metadata["layers"] = "1";
  written.tensors = {
      {"observation.mean", {"F64", {inputs}, std::vector<double>(inputs, 0)}},
      {"observation.deviation", {"F64", {inputs}, std::vector<double>(inputs, 1)}},
      {"action.low", {"F32", {actions}, specification.action_low}},
      {"action.high", {"F32", {actions}, specification.action_high}},
      {"layers.0.weight", {"F32", {actions, inputs}, weight}},
      {"layers.0.bias", {"F32", {actions}, std::vector<double>(actions, 0)}},
  };
  const std::string bytes = written.bytes();
  return {"remembering", {bytes.begin(), bytes.end()}};
}

class EpisodePlayerTest : public testing::TestWithParam<const char*> {};

TEST_P(EpisodePlayerTest, EpisodesHaveTheBitsOfSingleSteps) {
  const std::string id = GetParam();
  Policy first = shipped(id);
  Policy second = changed(first, 0.02F);
  const std::vector<World> worlds{{}, load_world("pushed")};
  Policy third = remembering(id);
  const std::vector<EpisodeJob> jobs{{0, 5, 0}, {2, 5, 0}, {1, 5, 0}, {2, 6, 1},
                                     {0, 6, 1}, {1, 7, 1}, {2, 7, 0}, {0, 1U << 31U, 0}};
  EpisodePlayer player([&] { return make(id); }, {2, 3, true});  // fewer environments than jobs
  const Outcomes outcomes = play(player, {&first, &second, &third}, worlds, jobs);
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    SCOPED_TRACE(i);
    Policy& policy = *std::array{&first, &second, &third}[jobs[i].policy];
    const PlayedEpisode expected = stepped(id, policy, jobs[i].seed, worlds[jobs[i].world]);
    EXPECT_EQ(fields(outcomes[i]), fields(expected));
    EXPECT_EQ(outcomes[i].observation_sums, expected.observation_sums);
    EXPECT_EQ(outcomes[i].observation_squares, expected.observation_squares);
    EXPECT_EQ(outcomes[i].info.size(), expected.info.size());
  }
}

INSTANTIATE_TEST_SUITE_P(Robots, EpisodePlayerTest,
                         testing::Values("BipedalWalker-v3", "Walker2d-v5", "Hopper-v4"));

TEST(EpisodePlayer, OutcomesDoNotDependOnThreadsOrCompany) {
  const Policy policy = shipped("Walker2d-v5");
  const Policy other = changed(policy, 0.05F);
  std::vector<EpisodeJob> jobs;
  for (std::uint64_t seed = 0; seed < 30; ++seed)
    jobs.push_back({seed % 3 == 0 ? 1U : 0U, seed, 0});
  Outcomes before;
  for (const EpisodePlayerOptions& options :
       std::vector<EpisodePlayerOptions>{{1, 1}, {1, 30}, {3, 7}, {2, 0}}) {
    EpisodePlayer player([] { return make("Walker2d-v5", {{"max_episode_steps", 200}}); }, options);
    for (int repetition = 0; repetition < 2; ++repetition) {  // its walkers are used again
      const Outcomes outcomes = play(player, {&policy, &other}, {}, jobs);
      if (before.empty()) before = outcomes;
      for (std::size_t i = 0; i < jobs.size(); ++i) {
        EXPECT_EQ(fields(outcomes[i]), fields(before[i])) << i;
      }
    }
  }
}

TEST(EpisodePlayer, PoliciesOfOtherSizesPlayTogether) {
  const Policy small = shipped("BipedalWalker-v3");
  const Policy large = shipped("BipedalWalkerHardcore-v3");
  ASSERT_NE(small.parameters().size(), large.parameters().size());
  EpisodePlayer player([] { return make("BipedalWalker-v3", {{"max_episode_steps", 50}}); });
  const Outcomes together = play(player, {&small, &large}, {}, {{0, 1}, {1, 1}, {0, 2}, {1, 2}});
  const Outcomes alone = play(player, {&large}, {}, {{0, 1}, {0, 2}});
  EXPECT_EQ(fields(together[1]), fields(alone[0]));
  EXPECT_EQ(fields(together[3]), fields(alone[1]));
}

TEST(EpisodePlayer, NoJobsAreNoEpisodes) {
  EpisodePlayer player([] { return make("Walker2d-v5"); });
  player.play({}, {}, {}, [](std::size_t, const PlayedEpisode&) { FAIL(); });
}

TEST(EpisodePlayer, ErrorsNameWhatIsWrong) {
  const auto walker = [] { return make("Walker2d-v5", {{"max_episode_steps", 20}}); };
  EpisodePlayer player(walker);
  const Policy policy = shipped("Walker2d-v5");
  const Policy other = shipped("Hopper-v4");
  const auto receive = [](std::size_t, const PlayedEpisode&) {};
  const auto message = [&](const std::vector<const Policy*>& policies,
                           const std::vector<World>& worlds, const EpisodeJob& job) {
    return message_of<std::exception>([&] { player.play(policies, worlds, {job}, receive); });
  };
  EXPECT_EQ(message({}, {}, {0, 0, 0}), "job 0: there is no policy");
  EXPECT_EQ(message({&policy}, {}, {1, 0, 0}), "job 0: policy = 1: must be in [0, 0]");
  EXPECT_EQ(message({&policy}, {{}, {}}, {0, 0, 2}), "job 0: world = 2: must be in [0, 1]");
  EXPECT_NE(message({&other}, {}, {0, 0, 0}).find("it takes 11 observations and gives 3 actions"),
            std::string::npos);
  EXPECT_NE(message({&policy}, {{{"gravity", {1e9, 1e9}}}}, {0, 0, 0}).find("gravity"),
            std::string::npos);
  const Policy overflowing =
      policy.with_parameters(std::vector<float>(policy.parameters().size(), 3e38F));
  EXPECT_NE(message({&policy, &overflowing}, {}, {1, 9, 0}).find("policy 1, seed 9: action "),
            std::string::npos);
  EXPECT_EQ(message_of<std::exception>([&] {
              policy.with_parameters({1, 2});
            }).substr(0, 7),
            "policy ");
  EXPECT_EQ(message_of<std::exception>([&] { EpisodePlayer(walker, {100000}); }),
            "num_threads = 100000: must be in [0, 1024]");
  EXPECT_EQ(message_of<std::exception>([] {
              EpisodePlayer([] { return make("BipedalWalker-v3", {{"reuse_world", true}}); });
            }),
            "reuse_world = true: an episode would depend on those before it");
  // None of this has spoilt the player.
  EXPECT_EQ(play(player, {&policy}, {}, {{0, 1, 0}})[0].length, 20);
}

TEST(EpisodePlayer, AnExceptionOfTheReceiverEndsTheCall) {
  EpisodePlayer player([] { return make("Walker2d-v5", {{"max_episode_steps", 20}}); }, {2});
  const Policy policy = shipped("Walker2d-v5");
  const std::vector<EpisodeJob> jobs(500, {0, 1, 0});
  std::size_t count = 0;
  const auto receive = [&](std::size_t, const PlayedEpisode&) {
    if (++count == 3) throw std::runtime_error("enough");
  };
  EXPECT_EQ(message_of<std::exception>([&] { player.play({&policy}, {}, jobs, receive); }),
            "enough");
  EXPECT_EQ(count, 3);
  EXPECT_EQ(play(player, {&policy}, {}, jobs).size(), 500);
}

TEST(EpisodePlayer, AnEngineThatFailsEndsItsEpisodeAlone) {
  int number = 0;
  const auto walker = [&] {
    auto robot = std::make_unique<FakeRobot>();
    robot->length = 5;
    robot->step_fails = number == 1;
    robot->reset_fails = number++ == 2;
    return std::make_unique<Walker>(std::move(robot));
  };
  EpisodePlayer player(walker, {1, 3});
  PolicyBytes written = small_policy();
  written.metadata["layers"] = "1";
  written.tensors["action.low"] = {"F32", {2}, {-1, -1}};
  written.tensors["action.high"] = {"F32", {2}, {1, 1}};
  const std::string bytes = written.bytes();
  const Policy policy("fake", {bytes.begin(), bytes.end()});
  const Outcomes outcomes = play(player, {&policy}, {}, std::vector<EpisodeJob>(7));
  int steps_failed = 0;
  int resets_failed = 0;
  for (const PlayedEpisode& one : outcomes) {
    if (one.error == "the engine gave up") ++steps_failed;
    if (one.error == "no ground") ++resets_failed;
    EXPECT_EQ(one.length, one.error.empty() ? 5 : (one.error == "no ground" ? 0 : 1));
    EXPECT_TRUE(one.terminated);
  }
  EXPECT_GT(steps_failed, 0);
  EXPECT_GT(resets_failed, 0);
}

}  // namespace
}  // namespace walker
