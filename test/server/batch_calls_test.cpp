// Batches without a master: the account of the shown environment against a simulation driven alone,
// and replies whose memory is used again.
#include "server/batch_calls.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "allocation_counter.h"
#include "bare_environment.h"
#include "bits.h"
#include "core/random.h"
#include "error_message.h"
#include "server/episode_states.h"
#include "server/simulation.h"
#include "walker_sim/registry.h"

namespace walker {
namespace {

constexpr std::uint32_t kShown = 2;
constexpr std::uint64_t kSeed = 11;

/// What a server has for its batches.
struct Herd {
  Herd(const std::string& id, AutoresetMode mode, std::uint32_t num_envs = 4)
      : options(options_of(id, mode, num_envs)),
        environments(make_environments(options, [id] { return make(id); })),
        calls(*environments, options, counters, episodes) {}

  static ServerOptions options_of(const std::string& id, AutoresetMode mode,
                                  std::uint32_t num_envs) {
    ServerOptions options{};
    options.id = id;
    options.mode = Mode::lockstep;
    options.seed = kSeed;
    options.num_envs = num_envs;
    options.num_threads = 2;
    options.autoreset_mode = mode;
    options.shown_environment = num_envs == 1 ? 0 : kShown;
    return options;
  }

  std::vector<double> actions() {
    const std::size_t size = environments->shown().specification().action_size();
    std::vector<double> all(environments->size() * size);
    for (double& value : all) value = generator.uniform(-1.5, 1.5);
    return all;
  }

  void reset(const std::vector<std::uint32_t>& listed = {}) {
    walker_sim::ResetBatch::Request request;
    walker_sim::ResetBatch::Response response;
    request.environments = listed;
    calls.reset(request, response);
  }

  ServerOptions options;
  ServerCounters counters;
  EpisodeStatistics episodes;
  std::unique_ptr<Environments> environments;
  BatchCalls calls;
  Generator generator{1};
  walker_sim::StepBatch::Response reply;
};

void expect_same_account(const EpisodeState& shown, const EpisodeState& alone) {
  EXPECT_EQ(shown.environment, kShown);
  EXPECT_EQ(shown.episode, alone.episode);
  expect_same_state(shown, alone);
}

void expect_same(ShownEnvironment& shown, Simulation& alone) {
  expect_same_account(shown.state(), alone.state());
  EXPECT_EQ(to_bits(shown.sensors().joint_position), to_bits(alone.sensors().joint_position));
  EXPECT_EQ(to_bits(shown.sensors().joint_velocity), to_bits(alone.sensors().joint_velocity));
  EXPECT_EQ(shown.sensors().linear_velocity, alone.sensors().linear_velocity);
  EXPECT_EQ(shown.sensors().contacts, alone.sensors().contacts);
  if (alone.state().step != 0) return;
  ASSERT_EQ(shown.scene().ground.size(), alone.scene().ground.size());
  for (std::size_t i = 0; i < alone.scene().ground.size(); ++i) {
    EXPECT_EQ(shown.scene().ground[i].points, alone.scene().ground[i].points);
  }
}

struct Case {
  const char* id;
  AutoresetMode mode;
};

class AnyBatch : public testing::TestWithParam<Case> {};

TEST_P(AnyBatch, TheShownEnvironmentIsASimulationDrivenAlone) {
  const auto [id, mode] = GetParam();
  Herd herd(id, mode);
  ShownEnvironment& shown = herd.environments->shown();
  const std::string name = id;
  Simulation alone([name] { return make(name); }, kSeed + kShown);
  EXPECT_FALSE(shown.has_episode());
  herd.reset();
  alone.reset(std::nullopt);
  expect_same(shown, alone);
  const std::size_t width = shown.specification().action_size();
  for (int i = 0; i < 500 && !HasFailure(); ++i) {
    const std::vector<double> actions = herd.actions();
    if (alone.state().has_ended()) {
      alone.reset(std::nullopt);
    } else {
      const double* own = actions.data() + kShown * width;
      alone.step(std::vector<double>(own, own + width));
    }
    herd.calls.step(actions, herd.reply);
    expect_same(shown, alone);
    herd.calls.reset_ended(herd.reply);
    if (alone.state().has_ended() && mode == AutoresetMode::same_step) {
      alone.reset(std::nullopt);
      expect_same(shown, alone);
    }
  }
  EXPECT_GT(alone.state().episode, 2U);
}

INSTANTIATE_TEST_SUITE_P(Modes, AnyBatch,
                         testing::Values(Case{"BipedalWalker-v3", AutoresetMode::next_step},
                                         Case{"BipedalWalker-v3", AutoresetMode::same_step},
                                         Case{"Walker2d-v5", AutoresetMode::next_step},
                                         Case{"Walker2d-v5", AutoresetMode::same_step}),
                         [](const testing::TestParamInfo<Case>& of) {
                           return std::string(of.param.id, of.param.id[0] == 'B' ? 13 : 8) +
                                  to_text(of.param.mode);
                         });

TEST(BatchCalls, CountEveryEnvironment) {
  Herd herd("BipedalWalker-v3", AutoresetMode::next_step);
  herd.reset();
  herd.reset({1, 3});
  EXPECT_EQ(herd.counters.resets, 6U);
  std::uint64_t ended = 0;
  for (int i = 0; i < 300; ++i) {
    herd.calls.step(herd.actions(), herd.reply);
    for (std::size_t j = 0; j < 4; ++j) {
      ended += herd.reply.terminated[j] != 0 || herd.reply.truncated[j] != 0 ? 1 : 0;
    }
  }
  EXPECT_GT(ended, 4U);
  EXPECT_EQ(herd.episodes.summary().episodes, ended);
  EXPECT_EQ(herd.counters.steps + herd.counters.resets, 6U + 4U * 300U);
  EXPECT_GE(herd.counters.resets, 6U + ended - 4U);
  EXPECT_GT(herd.counters.clamped_commands, herd.counters.steps / 2);
}

TEST(BatchCalls, AStatisticIsOfTheWholeEpisode) {
  Herd herd("BipedalWalker-v3", AutoresetMode::disabled);
  herd.reset();
  std::vector<double> returns(4);
  for (;;) {
    herd.calls.step(herd.actions(), herd.reply);
    for (std::size_t i = 0; i < 4; ++i) {
      returns[i] += herd.reply.rewards[i];
      if (herd.reply.terminated[i] == 0) continue;
      EXPECT_EQ(herd.episodes.summary().return_mean, returns[i]);
      EXPECT_EQ(herd.episodes.summary().length_mean, herd.reply.steps[i]);
      return;
    }
  }
}

/// Each episode has two steps of reward 1; the second reset of the one that is brittle fails.
class Brittle : public BareEnvironment {
 public:
  explicit Brittle(bool is_brittle) : is_brittle_(is_brittle) {
    specification_.observation_low = {0};
    specification_.observation_high = {1};
    specification_.action_low = {-1};
    specification_.action_high = {1};
    specification_.joints.resize(1);
  }

  void reset(std::optional<std::uint64_t> /*seed*/, Result& result) override {
    if (is_brittle_ && ++num_resets_ == 2) throw std::runtime_error("broken");
    steps_ = 0;
    result = {result.observation, result.info, 0, false, false, "", ""};
  }
  void step(const double* /*action*/, std::size_t /*size*/, Result& result) override {
    result.reward = 1;
    result.terminated = is_brittle_ && ++steps_ == 2;
    result.end_reason = result.terminated ? "over" : "";
  }

 private:
  bool is_brittle_;
  int num_resets_ = 0;
  int steps_ = 0;
};

TEST(Environments, OneThatFailsAtItsResetLeavesTheAccountOfTheOthersRight) {
  const ServerOptions options = Herd::options_of("Brittle", AutoresetMode::next_step, 3);
  int num_made = 0;
  const auto environments = make_environments(
      options, [&num_made] { return std::make_unique<Brittle>(num_made++ == 1); });
  ServerCounters counters;
  EpisodeStatistics episodes;
  BatchCalls calls(*environments, options, counters, episodes);
  walker_sim::ResetBatch::Response begun;
  calls.reset({}, begun);
  walker_sim::StepBatch::Response reply;
  const std::vector<double> actions(3);
  for (int i = 0; i < 2; ++i) calls.step(actions, reply);
  EXPECT_EQ(reply.terminated[1], 1);
  const std::string message = message_of<std::runtime_error>([&] { calls.step(actions, reply); });
  EXPECT_NE(message.find("environment 1: broken"), std::string::npos) << message;
  EXPECT_TRUE(reply.rewards.empty());
  EXPECT_EQ(environments->shown().state().step, 3U);
  EXPECT_EQ(environments->shown().state().episode_return, 3);
  EXPECT_NE(message_of<ResetNeeded>([&] { calls.step(actions, reply); }).find("environment 1"),
            std::string::npos);
  walker_sim::ResetBatch::Request request;
  request.environments = {1};
  calls.reset(request, begun);
  calls.step(actions, reply);
  EXPECT_EQ(environments->shown().state().step, 4U);
  EXPECT_EQ(environments->episode_return(1), 1);
}

/// A transport that keeps its reply pays for no memory.
TEST_F(AllocationTest, AReplyThatIsKeptTakesNoMoreMemory) {
  for (const std::uint32_t num_envs : {1U, 4U}) {
    Herd herd("Walker2d-v5", AutoresetMode::next_step, num_envs);
    herd.reset();
    const std::vector<double> actions = herd.actions();
    for (int i = 0; i < 500; ++i) herd.calls.step(actions, herd.reply);
    allocations = 0;
    const Counting counting;
    for (int i = 0; i < 500; ++i) herd.calls.step(actions, herd.reply);
    EXPECT_EQ(allocations, 0) << num_envs;
  }
}

}  // namespace
}  // namespace walker
