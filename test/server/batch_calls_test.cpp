// Batch calls without a master: the shown environment must equal an environment that is driven
// alone, and reused responses must not allocate.
#include "server/batch_calls.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "allocation_counter.h"
#include "bare_robot.h"
#include "base/random.h"
#include "bits.h"
#include "cramped_walker.h"
#include "episode_states.h"
#include "error_message.h"
#include "walker_sim/registry.h"

namespace walker {
namespace {

constexpr std::uint32_t kShown = 2;
constexpr std::uint64_t kSeed = 11;

/// An environment with the shown environment's seed, outside a pool.
std::unique_ptr<Episode> make_alone(const MakeEnvironment& make) {
  std::unique_ptr<Episode> alone(&episode_of(*make().release()));
  EpisodeOptions options;
  options.first_seed = kSeed + kShown;
  alone->configure(options);
  return alone;
}

/// The parts of a server that serve batch calls.
struct Herd {
  Herd(const std::string& id, AutoresetMode mode, std::uint32_t num_envs = 4)
      : options(options_of(id, mode, num_envs)),
        pool(make_pool(options, [id] { return make(id); })),
        calls(pool, options, counters, episodes) {}

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

  void reset(const std::vector<std::uint32_t>& listed = {}) {
    walker_sim::ResetBatch::Request request;
    walker_sim::ResetBatch::Response response;
    request.environments = listed;
    calls.reset(request, response);
  }

  ServerOptions options;
  ServerCounters counters;
  EpisodeStatistics episodes;
  Pool pool;
  BatchCalls calls;
  Generator generator{1};
  walker_sim::StepBatch::Response reply;
};

void expect_same_account(const EpisodeState& shown, const EpisodeState& alone) {
  EXPECT_EQ(shown.environment, kShown);
  EXPECT_EQ(shown.episode, alone.episode);
  expect_same_state(shown, alone);
}

void expect_same(Episode& shown, Episode& alone) {
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

TEST_P(AnyBatch, TheShownEnvironmentIsAsOneDrivenAlone) {
  const auto [id, mode] = GetParam();
  Herd herd(id, mode);
  Episode& shown = herd.pool.episode(kShown);
  const std::unique_ptr<Episode> driven_alone = make_alone([id = id] { return make_episode(id); });
  Episode& alone = *driven_alone;
  EXPECT_FALSE(shown.state().has_begun());
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

/// Resets fail in the middle one of three environments, or in a single environment.
class Failing : public testing::TestWithParam<AutoresetMode> {
 protected:
  using Flags = std::vector<std::uint8_t>;
  using Numbers = std::vector<std::uint32_t>;
  using Values = std::vector<double>;

  void serve(std::uint32_t num_envs, std::uint32_t shown) {
    options_ = Herd::options_of("Brittle", GetParam(), num_envs);
    options_.shown_environment = shown;
    int num_made = 0;
    calls_.reset();
    // NOLINTNEXTLINE(modernize-make-unique): a Pool does not move
    pool_ = std::unique_ptr<Pool>(new Pool(make_pool(options_, [&] {
      const bool may_fail = num_envs == 1 || num_made++ == 1;
      return std::make_unique<Episode>(std::make_unique<Brittle>(may_fail ? fails_ : never_));
    })));
    calls_.emplace(*pool_, options_, counters_, episodes_);
  }
  void reset(const Numbers& listed = {}) {
    walker_sim::ResetBatch::Request request;
    request.environments = listed;
    calls_->reset(request, begun_);
  }
  void step() {
    calls_->step(Values(options_.num_envs), reply_);
    calls_->reset_ended(reply_);
  }
  const EpisodeState& shown() { return pool_->episode(options_.shown_environment).state(); }
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
  ServerOptions options_;
  ServerCounters counters_;
  EpisodeStatistics episodes_;
  std::unique_ptr<Pool> pool_;
  std::optional<BatchCalls> calls_;
  walker_sim::ResetBatch::Response begun_;
  walker_sim::StepBatch::Response reply_;
};

constexpr const char* kOfTheMiddle = "environment 1: the simulation failed at its reset: broken";

TEST_P(Failing, AtItsResetLeavesTheOthersAlone) {
  serve(3, 1);
  fails_ = true;
  reset();
  EXPECT_EQ(begun_.status_message, kOfTheMiddle);
  EXPECT_EQ(begun_.observations, (Values{10, 0, 10}));
  EXPECT_EQ(begun_.info[0], 1);
  EXPECT_TRUE(std::isnan(begun_.info[1]));
  EXPECT_EQ(begun_.info[2], 1);
  expect_shown_failed(1);
  EXPECT_EQ(shown().seed, kSeed + 1);
  EXPECT_EQ(counters_.resets, 3U);
  EXPECT_EQ(counters_.simulation_errors, 1U);
  if (GetParam() == AutoresetMode::disabled) {
    EXPECT_EQ(message_of<ResetNeeded>([&] { step(); }),
              "environment 1: the simulation failed at its reset; reset first");
    return;
  }
  step();  // repeats the failed reset
  EXPECT_EQ(reply_.status_message, kOfTheMiddle);
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
  EXPECT_EQ(pool_->episode(1).state().episode_return, 1);
}

TEST_P(Failing, AtItsAutoresetLeavesTheOthersAlone) {
  serve(3, 1);
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
    EXPECT_EQ(reply_.final_observations, (Values{12, 12, 12}));
    EXPECT_EQ(reply_.final_info, (Values{1, 1, 1}));
  }
  EXPECT_EQ(reply_.status_message, kOfTheMiddle);
  EXPECT_EQ(reply_.observations, (Values{10, 0, 10}));
  EXPECT_EQ(reply_.episodes, (Numbers{2, 2, 2}));
  EXPECT_EQ(reply_.steps, (Numbers{0, 0, 0}));
  expect_shown_failed(2);
  EXPECT_EQ(episodes_.summary().episodes, 3U);
  EXPECT_EQ(episodes_.summary().failed, 0U);
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

TEST_P(Failing, AnotherThanTheShownOneDoesNotConcernIt) {
  serve(3, 2);
  fails_ = true;
  reset();
  EXPECT_EQ(shown().episode, 1U);
  EXPECT_EQ(shown().error, "");
  EXPECT_EQ(shown().seed, kSeed + 2);
  if (GetParam() == AutoresetMode::disabled) return;
  step();
  EXPECT_EQ(shown().step, 1U);
  EXPECT_EQ(shown().episode_return, 1);
}

TEST_P(Failing, AloneIsTheSame) {
  serve(1, 0);
  fails_ = true;
  reset();
  EXPECT_EQ(begun_.status_message, "environment 0: the simulation failed at its reset: broken");
  EXPECT_EQ(begun_.observations, Values{0});
  expect_shown_failed(1);
  if (GetParam() == AutoresetMode::disabled) return;  // the step is refused
  step();
  EXPECT_EQ(reply_.status_message, "environment 0: the simulation failed at its reset: broken");
  EXPECT_EQ(reply_.terminated, Flags{1});
  EXPECT_EQ(reply_.steps, Numbers{0});
  EXPECT_EQ(reply_.episodes, Numbers{2});
  EXPECT_EQ(reply_.final_environments.size(), GetParam() == AutoresetMode::same_step ? 1U : 0U);
  fails_ = false;
  step();
  EXPECT_EQ(reply_.status_message, "");
  EXPECT_EQ(reply_.steps, Numbers{0});
  EXPECT_EQ(reply_.observations, Values{10});
  step();
  EXPECT_EQ(reply_.steps, Numbers{1});
  EXPECT_EQ(counters_.simulation_errors, 2U);
}

INSTANTIATE_TEST_SUITE_P(Modes, Failing,
                         testing::Values(AutoresetMode::next_step, AutoresetMode::same_step,
                                         AutoresetMode::disabled),
                         [](const auto& instance) { return to_text(instance.param); });

/// Bitwise, with failures that MuJoCo raises.
TEST_P(AnyBatch, AShownOneThatFailsAtResetsIsAsOneDrivenAlone) {
  const AutoresetMode mode = GetParam().mode;
  if (std::string(GetParam().id) != "Walker2d-v5") return;
  const CrampedWalker cramped;
  ServerOptions options = Herd::options_of("Walker2d-v5", mode, 4);
  Pool pool = make_pool(options, std::ref(cramped));
  ServerCounters counters;
  EpisodeStatistics episodes;
  BatchCalls calls(pool, options, counters, episodes);
  const std::unique_ptr<Episode> driven_alone = make_alone(std::ref(cramped));
  Episode& alone = *driven_alone;
  walker_sim::ResetBatch::Response begun;
  walker_sim::StepBatch::Response reply;
  calls.reset({}, begun);
  alone.reset(std::nullopt);
  std::uint32_t failed = 0;
  const std::vector<double> actions(24, 0.5);
  const std::vector<double> action(6, 0.5);
  for (int i = 0; i < 400 && !HasFailure(); ++i) {
    const bool resets = mode == AutoresetMode::next_step ? alone.state().has_ended()
                                                         : alone.state().failed_at_reset();
    if (resets) {
      alone.reset(std::nullopt);
    } else {
      alone.step(action);
    }
    calls.step(actions, reply);
    expect_same_account(pool.episode(kShown).state(), alone.state());
    calls.reset_ended(reply);
    if (alone.state().has_ended() && !alone.state().failed_at_reset() &&
        mode == AutoresetMode::same_step) {
      alone.reset(std::nullopt);
      expect_same_account(pool.episode(kShown).state(), alone.state());
    }
    failed += alone.state().failed_at_reset() ? 1 : 0;
  }
  EXPECT_GT(failed, 1U);
}

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
