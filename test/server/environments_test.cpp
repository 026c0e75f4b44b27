// Batch calls without a master: what the shown environment shows, counters, messages and failures;
// reused responses must not allocate.
#include "server/environments.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <optional>
#include <stdexcept>
#include <tuple>

#include "allocation_counter.h"
#include "base/random.h"
#include "bits.h"
#include "episode/fake_walker.h"
#include "error_message.h"
#include "restorable.h"
#include "walker_sim/registry.h"

namespace walker {
namespace {

constexpr std::uint32_t kShown = 2;
constexpr std::uint64_t kSeed = 11;

/// An environment with the shown environment's seed, outside a pool.
std::unique_ptr<Episode> make_alone(const std::string& id) {
  std::unique_ptr<Episode> alone = make_episode(id);
  EpisodeOptions options;
  options.first_seed = kSeed + kShown;
  alone->configure(options);
  return alone;
}

/// The parts of a server that make batch calls.
struct BatchServer {
  BatchServer(const std::string& id, AutoresetMode mode, std::uint32_t num_envs = 4)
      : options(options_of(id, mode, num_envs)),
        pool(make_pool(options, [id] { return make(id); })),
        calls(pool, options, account) {}

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
    const std::size_t size = pool.specification().action_size();
    std::vector<double> all(pool.options().num_envs * size);
    for (double& value : all) value = generator.uniform(-1.5, 1.5);
    return all;
  }

  ResetBatch::Response reset(const std::vector<std::uint32_t>& listed = {}) {
    ResetBatch::Request request;
    ResetBatch::Response response;
    request.environments = listed;
    calls.reset(request, response);
    return response;
  }

  ServerOptions options;
  Account account;
  Pool pool;
  BatchCalls calls;
  Generator generator{1};
  StepBatch::Response reply;
};

void expect_same_account(const EpisodeState& shown, const EpisodeState& alone) {
  EXPECT_EQ(shown.environment, kShown);
  EXPECT_EQ(shown.episode, alone.episode);
  expect_same_state(shown, alone);
}

void expect_same_sensors(Episode& shown, Episode& alone) {
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

class AnyBatch : public testing::TestWithParam<std::tuple<const char*, AutoresetMode>> {};

TEST_P(AnyBatch, ShowsTheAccountAndTheSensorsOfAnEnvironmentAlone) {
  const auto& [id, mode] = GetParam();
  BatchServer server(id, mode);
  Episode& shown = server.pool.episode(kShown);
  const std::unique_ptr<Episode> driven_alone = make_alone(id);
  Episode& alone = *driven_alone;
  const auto expect_same = [&] {
    expect_same_account(shown.state(), alone.state());
    expect_same_sensors(shown, alone);
  };
  EXPECT_FALSE(shown.state().has_begun());
  server.reset();
  alone.reset(std::nullopt);
  expect_same();
  const std::size_t width = shown.specification().action_size();
  for (int i = 0; i < 500 && !HasFailure(); ++i) {
    const std::vector<double> actions = server.actions();
    if (alone.state().has_ended()) {
      alone.reset(std::nullopt);
    } else {
      alone.step(&actions[kShown * width], width);
    }
    int num_shown = 0;
    server.calls.step(actions, server.reply, [&] {
      ++num_shown;
      expect_same();
    });
    EXPECT_EQ(num_shown, 1);
    for (std::uint32_t j = 0; j < 4; ++j) {
      EXPECT_EQ(server.reply.episodes[j], server.pool.episode(j).state().episode);
      EXPECT_EQ(server.reply.steps[j], server.pool.episode(j).state().step);
    }
    if (mode == AutoresetMode::same_step && alone.state().has_ended()) {
      alone.reset(std::nullopt);
      expect_same();
    }
  }
  EXPECT_GT(alone.state().episode, 2U);
}

INSTANTIATE_TEST_SUITE_P(Modes, AnyBatch,
                         testing::Combine(testing::Values("BipedalWalker-v3", "Walker2d-v5"),
                                          testing::Values(AutoresetMode::next_step,
                                                          AutoresetMode::same_step)));

TEST(BatchCalls, ReturnTheRowsOfAResetAsListed) {
  BatchServer server("BipedalWalker-v3", AutoresetMode::next_step);
  server.reset();
  const std::vector<double> rows = server.reset({3, 1}).observations;
  std::vector<double> expected = server.pool.episode(3).state().observation;
  const std::vector<double>& second = server.pool.episode(1).state().observation;
  expected.insert(expected.end(), second.begin(), second.end());
  EXPECT_EQ(to_bits(rows), to_bits(expected));
}

TEST(BatchCalls, CountStepsResetsAndEpisodes) {
  BatchServer server("BipedalWalker-v3", AutoresetMode::next_step);
  server.reset();
  server.reset({1, 3});
  EXPECT_EQ(server.account.counters.resets, 6U);
  std::uint64_t ended = 0;
  for (int i = 0; i < 300; ++i) {
    server.calls.step(server.actions(), server.reply);
    for (std::size_t j = 0; j < 4; ++j) {
      ended += server.reply.terminated[j] != 0 || server.reply.truncated[j] != 0 ? 1 : 0;
    }
  }
  EXPECT_GT(ended, 4U);
  EXPECT_EQ(server.account.episodes.summary().episodes, ended);
  EXPECT_EQ(server.account.counters.steps + server.account.counters.resets, 6U + 4U * 300U);
  EXPECT_GE(server.account.counters.resets, 6U + ended - 4U);
  EXPECT_GT(server.account.counters.clamped_commands, server.account.counters.steps / 2);
}

TEST(BatchCalls, RecordReturnAndLengthOfAnEpisode) {
  BatchServer server("BipedalWalker-v3", AutoresetMode::disabled);
  server.reset();
  std::vector<double> returns(4);
  for (;;) {
    server.calls.step(server.actions(), server.reply);
    for (std::size_t i = 0; i < 4; ++i) {
      returns[i] += server.reply.rewards[i];
      if (server.reply.terminated[i] == 0) continue;
      EXPECT_EQ(server.account.episodes.summary().return_mean, returns[i]);
      EXPECT_EQ(server.account.episodes.summary().length_mean, server.reply.steps[i]);
      return;
    }
  }
}

/// A robot whose episodes last two steps of reward 1. Resets fail while `resets_fail` is true.
class Brittle : public BareRobot {
 public:
  explicit Brittle(const bool& resets_fail) : resets_fail_(resets_fail) {
    specification_.observation_low = {0};
    specification_.observation_high = {1};
    specification_.action_low = {-1};
    specification_.action_high = {1};
    specification_.joints.resize(1);
    specification_.info_names = {"one"};
  }

  void reset(Generator& /*generator*/, double* info) override {
    if (resets_fail_) throw std::runtime_error("broken");
    steps_ = 0;
    info[0] = 1;
  }
  void step(RobotStep& step) override {
    ++steps_;
    step.reward = 1;
    step.terminated = steps_ == 2;
    step.end_reason = "over";
    step.info[0] = 1;
  }
  void observe(double* observation) const override { observation[0] = 10 + steps_; }

 private:
  const bool& resets_fail_;
  int steps_ = 0;
};

/// Resets fail in the middle one of three environments.
class Failing : public testing::TestWithParam<AutoresetMode> {
 protected:
  using Flags = std::vector<std::uint8_t>;
  using Numbers = std::vector<std::uint32_t>;
  using Values = std::vector<double>;

  static ServerOptions make_options() {
    ServerOptions options = BatchServer::options_of("Brittle", GetParam(), 3);
    options.shown_environment = 1;
    return options;
  }
  std::unique_ptr<Environment> make_brittle() {
    const bool may_fail = num_made_++ == 1;
    return std::make_unique<Episode>(std::make_unique<Brittle>(may_fail ? fails_ : never_));
  }
  void reset(const Numbers& listed = {}) {
    ResetBatch::Request request;
    request.environments = listed;
    calls_.reset(request, begun_);
  }
  void step() { calls_.step(Values(options_.num_envs), reply_); }
  const EpisodeState& shown() { return pool_.episode(options_.shown_environment).state(); }
  void expect_shown_failed(std::uint32_t episode) {
    EXPECT_TRUE(shown().failed_at_reset());
    EXPECT_EQ(shown().episode, episode);
    EXPECT_EQ(shown().error, "broken");
    EXPECT_EQ(shown().end_reason, "terminated: the simulation failed at its reset");
    EXPECT_EQ(shown().observation, Values{0});
    EXPECT_EQ(shown().reward, 0);
    EXPECT_TRUE(shown().action.empty());
  }

  const bool never_ = false;
  bool fails_ = false;
  int num_made_ = 0;
  ServerOptions options_ = make_options();
  Account account_;
  Pool pool_ = make_pool(options_, [this] { return make_brittle(); });
  BatchCalls calls_{pool_, options_, account_};
  ResetBatch::Response begun_;
  StepBatch::Response reply_;
};

constexpr const char* kMiddleFailed = "environment 1: the simulation failed at its reset: broken";

TEST_P(Failing, ResetAffectsOnlyItsEnvironment) {
  fails_ = true;
  reset();
  EXPECT_EQ(begun_.status_message, kMiddleFailed);
  EXPECT_EQ(begun_.observations, (Values{10, 0, 10}));
  EXPECT_EQ(begun_.info[0], 1);
  EXPECT_TRUE(std::isnan(begun_.info[1]));
  EXPECT_EQ(begun_.info[2], 1);
  expect_shown_failed(1);
  EXPECT_EQ(shown().seed, kSeed + 1);
  EXPECT_EQ(account_.counters.resets, 3U);
  EXPECT_EQ(account_.counters.simulation_errors, 1U);
  if (GetParam() == AutoresetMode::disabled) {
    EXPECT_EQ(message_of<ResetNeeded>([&] { step(); }),
              "environment 1: the simulation failed at its reset; reset first");
    return;
  }
  step();  // repeats the failed reset
  EXPECT_EQ(reply_.status_message, kMiddleFailed);
  EXPECT_EQ(reply_.rewards, (Values{1, 0, 1}));
  EXPECT_EQ(reply_.observations, (Values{11, 0, 11}));
  EXPECT_EQ(reply_.terminated, (Flags{0, 1, 0}));
  EXPECT_EQ(reply_.episodes, (Numbers{1, 2, 1}));
  EXPECT_EQ(reply_.steps, (Numbers{1, 0, 1}));
  const bool is_same_step = GetParam() == AutoresetMode::same_step;
  EXPECT_EQ(reply_.final_environments, is_same_step ? Numbers{1} : Numbers{});
  EXPECT_EQ(reply_.final_observations, is_same_step ? Values{0} : Values{});
  expect_shown_failed(2);
  fails_ = false;
  reset({1});
  EXPECT_EQ(begun_.status_message, "");
  EXPECT_EQ(shown().error, "");
  EXPECT_EQ(shown().end_reason, "");
  step();
  EXPECT_EQ(reply_.status_message, "");
  EXPECT_EQ(reply_.steps[1], 1U);
  EXPECT_EQ(pool_.episode(1).state().episode_return, 1);
}

TEST_P(Failing, AutoresetAffectsOnlyItsEnvironment) {
  if (GetParam() == AutoresetMode::disabled) return;
  reset();
  step();
  fails_ = true;
  step();
  EXPECT_EQ(reply_.rewards, (Values{1, 1, 1}));
  EXPECT_EQ(reply_.terminated, (Flags{1, 1, 1}));
  if (GetParam() == AutoresetMode::next_step) {
    EXPECT_EQ(reply_.status_message, "");
    step();
    EXPECT_EQ(reply_.rewards, (Values{0, 0, 0}));
    EXPECT_EQ(reply_.terminated, (Flags{0, 1, 0}));
  } else {
    EXPECT_EQ(reply_.final_environments, (Numbers{0, 1, 2}));
  }
  EXPECT_EQ(reply_.status_message, kMiddleFailed);
  EXPECT_EQ(reply_.observations, (Values{10, 0, 10}));
  EXPECT_EQ(reply_.episodes, (Numbers{2, 2, 2}));
  EXPECT_EQ(reply_.steps, (Numbers{0, 0, 0}));
  expect_shown_failed(2);
  EXPECT_EQ(account_.episodes.summary().episodes, 3U);
  EXPECT_EQ(account_.episodes.summary().failed, 0U);
  fails_ = false;
  step();
  EXPECT_EQ(reply_.status_message, "");
  EXPECT_EQ(reply_.rewards, (Values{1, 0, 1}));
  EXPECT_EQ(reply_.terminated, (Flags{0, 0, 0}));
  EXPECT_EQ(reply_.observations, (Values{11, 10, 11}));
  EXPECT_EQ(reply_.steps, (Numbers{1, 0, 1}));
  EXPECT_EQ(shown().step, 0U);
  EXPECT_EQ(shown().error, "");
}

INSTANTIATE_TEST_SUITE_P(Modes, Failing,
                         testing::Values(AutoresetMode::next_step, AutoresetMode::same_step,
                                         AutoresetMode::disabled),
                         [](const auto& instance) { return to_text(instance.param); });

TEST_F(AllocationTest, StepsWithAReusedResponseDoNotAllocate) {
  for (const std::uint32_t num_envs : {1U, 4U}) {
    BatchServer server("Walker2d-v5", AutoresetMode::next_step, num_envs);
    server.reset();
    const std::vector<double> actions = server.actions();
    for (int i = 0; i < 500; ++i) server.calls.step(actions, server.reply);
    allocations = 0;
    const Counting counting;
    for (int i = 0; i < 500; ++i) server.calls.step(actions, server.reply);
    EXPECT_EQ(allocations, 0) << num_envs;
  }
}

}  // namespace
}  // namespace walker
