// A pool's calls and errors, with fake environments and two threads. Worlds need real ones.
#include "walker_sim/pool.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <stdexcept>
#include <utility>

#include "base/interruption.h"
#include "bits.h"
#include "episode/fake_robot.h"
#include "episode/rollout.h"
#include "error_message.h"

namespace walker {
namespace {

using List = std::vector<std::uint32_t>;
using Flags = std::vector<std::uint8_t>;
using Values = std::vector<double>;
using Seeds = std::vector<std::optional<std::uint64_t>>;

constexpr std::size_t kCount = 3;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
const Values kOnes(2 * kCount, 1);

class PoolTest : public testing::Test {
 protected:
  void make(AutoresetMode mode, std::size_t batch_size = 0) {
    fakes_ = {};
    pool_ = std::make_unique<Pool>(fakes_, PoolOptions{kCount, 2, mode, batch_size});
    arrays_ = std::make_unique<PoolArrays>(pool_->specification(), kCount);
  }
  void SetUp() override { make(AutoresetMode::next_step); }

  void reset(const List& environments = {}, const Seeds& seeds = {}) {
    pool_->reset(environments, seeds, arrays_->batch());
  }
  void step(const Values& actions = Values(kCount * 2)) {
    pool_->step(actions.data(), actions.size(), arrays_->batch());
  }
  void send(const List& environments) {
    const Values actions(environments.size() * 2, 0.5);
    pool_->send(actions.data(), environments.data(), environments.size());
  }
  void step_some(const List& environments) {
    const Values actions(kCount * 2);
    pool_->step(actions.data(), environments.data(), environments.size(), arrays_->batch());
  }
  List recv() {
    List environments(pool_->options().batch_size);
    pool_->recv(arrays_->batch(), environments.data());
    return environments;
  }
  std::vector<int> steps_of_all() const {
    std::vector<int> steps;
    steps.reserve(kCount);
    for (std::size_t i = 0; i < kCount; ++i) steps.push_back(fakes_[i].all_steps);
    return steps;
  }

  /// @param row reward, terminated, truncated, episode, step; observation, info; the final ones
  void expect_row(std::size_t index, Values row) const {
    if (row.size() == 8) row.resize(11, PoolArrays::kUntouched);
    EXPECT_EQ(to_bits(arrays_->row(index)), to_bits(row))
        << "row " << index << ": " << testing::PrintToString(arrays_->row(index));
  }

  /// Expects that environment 1 could not be reset; with same_step, its row is also a final one.
  void expect_failed_reset(AutoresetMode mode, double episode) const {
    Values row{0, 1, 0, episode, 0, /**/ 0, 0, kNan};
    if (mode == AutoresetMode::same_step) row.insert(row.end(), {0, 0, kNan});
    expect_row(1, row);
  }

  template <typename Exception, typename Call>
  std::string refusal(Call call) {
    const std::vector<int> before = steps_of_all();
    std::string message = message_of<Exception>(call);
    EXPECT_EQ(steps_of_all(), before) << "nothing may have moved";
    return message;
  }

  Fakes<> fakes_;
  std::unique_ptr<Pool> pool_;
  std::unique_ptr<PoolArrays> arrays_;
};

std::string refused_options(const PoolOptions& options) {
  return message_of<std::invalid_argument>([&] { Pool(Fakes<>{}, options); });
}

TEST_F(PoolTest, CompletesAndChecksOptions) {
  PoolOptions options;
  options.num_envs = 5;
  const Pool pool(Fakes<>{}, options);
  EXPECT_GE(pool.options().num_threads, 1U);
  EXPECT_LE(pool.options().num_threads, 5U);
  EXPECT_EQ(pool.options().batch_size, 5U);
  options.batch_size = 6;
  EXPECT_EQ(refused_options(options), "batch_size = 6: must be in [0, 5]");
  options.batch_size = 0;
  options.num_threads = 1025;
  EXPECT_EQ(refused_options(options), "num_threads = 1025: must be in [0, 1024]");
  options.num_envs = 0;
  EXPECT_EQ(refused_options(options), "num_envs = 0: must be in [1, 1048576]");
}

/// A signal interrupts the construction between any two environments.
TEST(PoolInterruption, EndsTheConstruction) {
  constexpr std::size_t kMade = 3;
  static Fakes<> fakes;
  fakes = {};
  set_poll([](pollfd* files, nfds_t num_files, int timeout) {
    if (fakes.all->size() == kMade) throw Interrupted();
    return ::poll(files, num_files, timeout);
  });
  PoolOptions options;
  options.num_envs = 100;
  EXPECT_THROW(Pool(fakes, options), Interrupted);
  set_poll(&::poll);
  EXPECT_EQ(fakes.all->size(), kMade);
}

TEST_F(PoolTest, RejectsDifferentEnvironments) {
  class Other : public FakeRobot {
   public:
    Other() { specification_.info_names = {"seed", "more"}; }
  };
  int made = 0;
  const auto make = [&]() -> std::unique_ptr<Environment> {
    if (++made < 3) return std::make_unique<Walker>(std::make_unique<FakeRobot>());
    return std::make_unique<Walker>(std::make_unique<Other>());
  };
  PoolOptions options;
  options.num_envs = 3;
  EXPECT_EQ(message_of<std::invalid_argument>([&] { Pool(make, options); }),
            "environment 2: Fake-v0; must be as the first one, Fake-v0 with the same parameters");
}

TEST_F(PoolTest, LeavesOutNullArrays) {
  make(AutoresetMode::same_step);
  fakes_[0].length = 1;
  pool_->reset({}, {}, {});
  const Values actions(kCount * 2);
  pool_->step(actions.data(), actions.size(), {});
  EXPECT_EQ(steps_of_all(), (std::vector<int>{1, 1, 1}));
}

TEST_F(PoolTest, NextStepResetsInTheFollowingStepAndIgnoresItsAction) {
  fakes_[1].length = 2;
  reset();
  step();
  step(kOnes);
  expect_row(1, {2, 1, 0, 1, 2, /**/ 1, 2, -1});
  EXPECT_STREQ(pool_->end_reason(1), "fell");
  EXPECT_STREQ(pool_->end_reason(0), "");
  step(kOnes);
  expect_row(1, {0, 0, 0, 2, 0, /**/ 2, 0, -1});
  EXPECT_EQ(arrays_->steps, (List{3, 0, 3}));
  EXPECT_STREQ(pool_->end_reason(1), "");
  step();
  EXPECT_EQ(arrays_->steps, (List{4, 1, 4}));
}

TEST_F(PoolTest, SameStepResetsAtOnceAndReturnsTheFinalRow) {
  make(AutoresetMode::same_step);
  fakes_[1].length = 2;
  reset({}, {5, 6, 7});
  step();
  step(kOnes);
  expect_row(1, {2, 1, 0, 2, 0, /**/ 2, 0, -1, /**/ 1, 2, -1});
  EXPECT_STREQ(pool_->end_reason(1), "fell");
  EXPECT_EQ(arrays_->final_info[0], PoolArrays::kUntouched);
  arrays_->forget_final(1);
  step(kOnes);
  expect_row(1, {2, 0, 0, 2, 1, /**/ 2, 1, -1});
  EXPECT_STREQ(pool_->end_reason(1), "");
}

TEST_F(PoolTest, RefusesTheWholeStepIfOneNeedsAReset) {
  const auto expect_refusals = [this](const std::string& reason) {
    const std::string message = "environment 1: " + reason + "; reset first";
    EXPECT_EQ(refusal<ResetNeeded>([this] { step(); }), message);
    EXPECT_EQ(refusal<ResetNeeded>([this] { send({0, 1}); }), message);
  };
  reset({0, 2});
  expect_refusals("there is no episode yet");
  make(AutoresetMode::disabled);
  fakes_[1].reset_fails = true;
  reset();
  expect_refusals("the simulation failed at its reset");
  fakes_[1].reset_fails = false;
  fakes_[1].length = 2;
  reset();
  step();
  step();
  expect_refusals("the episode ended after 2 steps");
  reset({1}, {8});
  EXPECT_EQ(arrays_->info, (Values{-1, 8, -1}));
  EXPECT_EQ(arrays_->episodes, (List{2, 3, 2}));
  step();
  EXPECT_EQ(arrays_->steps, (List{3, 1, 3}));
}

TEST_F(PoolTest, ChecksAllActionsBeforeAnyStep) {
  reset();
  EXPECT_EQ(refusal<InvalidAction>([&] { step(Values(5)); }),
            "actions have 5 values; must have 6, 2 for each of 3 environments");
  const Values unknown{0, 0, 0, 0, 0, kNan};
  EXPECT_EQ(refusal<InvalidAction>([&] { step(unknown); }),
            "environment 2: action[1] (knee) = nan; must be finite");
  const Values infinite{0, 0, -std::numeric_limits<double>::infinity(), 0};
  const List environments{2, 0};
  EXPECT_EQ(refusal<InvalidAction>([&] { pool_->send(infinite.data(), environments.data(), 2); }),
            "environment 0: action[0] (hip) = -inf; must be finite");
  step();
  EXPECT_EQ(arrays_->steps, (List{1, 1, 1}));
}

TEST_F(PoolTest, ResetsTheListedEnvironmentsWithTheirSeeds) {
  reset({2, 0}, {7, std::nullopt});
  EXPECT_EQ(arrays_->info, (Values{-1, PoolArrays::kUntouched, 7}));
  EXPECT_EQ(arrays_->episodes, (List{1, 999, 1}));
  EXPECT_EQ(arrays_->terminated, (Flags{0, 9, 0}));
}

TEST_F(PoolTest, RejectsMalformedLists) {
  reset();
  const auto refused = [this](const auto& call) { return refusal<std::invalid_argument>(call); };
  const List outside{0, 3};
  const List twice{0, 1, 0};
  const std::function<void(const List&)> calls[] = {
      [this](const List& list) { reset(list); },
      [this](const List& list) { step_some(list); },
      [this](const List& list) { send(list); },
      [this](const List& list) { pool_->send_resets(list); },
  };
  for (const auto& call : calls) {
    EXPECT_EQ(refused([&] { call(outside); }), "environment 3: must be in [0, 2]");
    EXPECT_EQ(refused([&] { call(twice); }), "environment 0: listed twice");
  }
  const List two{0, 1};
  EXPECT_EQ(refused([&] { reset(two, {7}); }), "1 seeds; must be 0, or 2, one per environment");
  EXPECT_EQ(refused([&] { reset({}, Seeds(2)); }), "2 seeds; must be 0, or 3, one per environment");
  EXPECT_EQ(refused([&] { step_some({}); }), "step: no environment is listed");
  EXPECT_EQ(refused([&] { pool_->environment(3); }), "environment 3: must be in [0, 2]");
  EXPECT_EQ(fakes_[0].episode, 1);
}

TEST_F(PoolTest, AFailedStepEndsItsOwnEpisodeOnly) {
  make(AutoresetMode::same_step);
  reset({}, {1, 2, 3});
  step();
  fakes_[1].step_fails = true;
  step(kOnes);
  expect_row(0, {2, 0, 0, 1, 2, /**/ 1, 2, -1});
  expect_row(1, {0, 1, 0, 2, 0, /**/ 2, 0, -1, /**/ 1, 1, kNan});
  expect_row(2, {2, 0, 0, 1, 2, /**/ 1, 2, -1});
  EXPECT_STREQ(pool_->error(1), "the engine gave up");
  EXPECT_STREQ(pool_->end_reason(1), "the simulation failed");
  EXPECT_STREQ(pool_->error(0), "");
  fakes_[1].step_fails = false;
  step();
  EXPECT_STREQ(pool_->error(1), "");
  EXPECT_EQ(arrays_->steps, (List{3, 1, 3}));
}

TEST_F(PoolTest, AFailedStepKeepsTheLastObservationInAnyArrays) {
  reset();
  step();
  fakes_[2].step_fails = true;
  PoolArrays others(pool_->specification(), kCount);
  const Values actions(kCount * 2);
  pool_->step(actions.data(), actions.size(), others.batch());
  EXPECT_EQ(others.observations, (Values{1, 2, 1, 2, 1, 1}));
}

TEST_F(PoolTest, AFailedResetIsAnEndedEpisodeAndRepeatedByTheNextStep) {
  for (const AutoresetMode mode : kModes) {
    make(mode);
    fakes_[1].reset_fails = true;
    reset({}, {5, 6, 7});
    expect_row(0, {0, 0, 0, 1, 0, /**/ 1, 0, 5});
    expect_failed_reset(mode, 1);
    expect_row(2, {0, 0, 0, 1, 0, /**/ 1, 0, 7});
    EXPECT_STREQ(pool_->reset_error(1), "no ground");
    EXPECT_STREQ(pool_->error(1), "");
    EXPECT_STREQ(pool_->end_reason(1), "the simulation failed at its reset");
    EXPECT_STREQ(pool_->reset_error(0), "");
    if (mode != AutoresetMode::disabled) {
      arrays_->forget_final(1);
      step(kOnes);
      expect_row(0, {2, 0, 0, 1, 1, /**/ 1, 1, -1});
      expect_failed_reset(mode, 2);
      EXPECT_STREQ(pool_->reset_error(1), "no ground");
      fakes_[1].reset_fails = false;
      arrays_->forget_final(1);
      step(kOnes);
      expect_row(1, {0, 0, 0, 3, 0, /**/ 1, 0, 6});  // its action is ignored
      EXPECT_STREQ(pool_->reset_error(1), "");
    }
    fakes_[1].reset_fails = false;
    arrays_->forget_final(1);
    reset({1}, {8});
    if (mode == AutoresetMode::disabled) {
      expect_row(1, {0, 0, 0, 2, 0, /**/ 1, 0, 8});
    } else {
      expect_row(1, {0, 0, 0, 4, 0, /**/ 2, 0, 8});
    }
    EXPECT_STREQ(pool_->reset_error(1), "");
    EXPECT_STREQ(pool_->end_reason(1), "");
    step();
    EXPECT_EQ(arrays_->steps[1], 1U);
  }
}

TEST_F(PoolTest, AFailedAutoresetLeavesTheOthersAlone) {
  fakes_[1].length = 2;
  reset();
  step();
  step();
  fakes_[1].reset_fails = true;
  step(kOnes);
  expect_row(0, {2, 0, 0, 1, 3, /**/ 1, 3, -1});
  expect_row(1, {0, 1, 0, 2, 0, /**/ 0, 0, kNan});
  EXPECT_STREQ(pool_->reset_error(1), "no ground");
}

/// Reward and flags are those of the old episode's last step.
TEST_F(PoolTest, AFailedAutoresetInTheSameStepKeepsTheEnd) {
  make(AutoresetMode::same_step);
  fakes_[1].length = 2;
  reset({}, {5, 6, 7});
  step();
  fakes_[1].reset_fails = true;
  step(kOnes);
  expect_row(0, {2, 0, 0, 1, 2, /**/ 1, 2, -1});
  expect_row(1, {2, 1, 0, 2, 0, /**/ 0, 0, kNan, /**/ 1, 2, -1});
  EXPECT_STREQ(pool_->end_reason(1), "fell");
  EXPECT_STREQ(pool_->error(1), "");
  EXPECT_STREQ(pool_->reset_error(1), "no ground");
  fakes_[1].reset_fails = false;
  step(kOnes);
  EXPECT_EQ(arrays_->episodes[1], 3U);
  EXPECT_EQ(arrays_->steps, (List{3, 0, 3}));
}

TEST_F(PoolTest, AStepAndTheResetAfterItMayBothFail) {
  make(AutoresetMode::same_step);
  reset();
  fakes_[1].step_fails = true;
  fakes_[1].reset_fails = true;
  step();
  EXPECT_STREQ(pool_->error(1), "the engine gave up");
  EXPECT_STREQ(pool_->reset_error(1), "no ground");
  EXPECT_STREQ(pool_->end_reason(1), "the simulation failed");
}

TEST_F(PoolTest, SendingCopiesTheActions) {
  reset();
  Values actions{1, 2, 3, 4, 5, 6};
  const List environments{2, 1, 0};
  pool_->send(actions.data(), environments.data(), 3);
  actions.assign(6, 100);
  const List arrived = recv();
  for (std::size_t row = 0; row < kCount; ++row) {
    EXPECT_EQ(arrays_->rewards[row], 11 - 4.0 * arrived[row]) << arrived[row];
  }
}

TEST_F(PoolTest, ResetsAreSentAndReceivedInEveryMode) {
  for (const AutoresetMode mode : kModes) {
    make(mode, 1);
    pool_->send_resets({});
    std::vector<int> received(kCount);
    for (std::size_t i = 0; i < kCount; ++i) {
      ++received[recv()[0]];
      expect_row(0, {0, 0, 0, 1, 0, /**/ 1, 0, -1});
    }
    EXPECT_EQ(received, (std::vector<int>{1, 1, 1}));
    send({2});
    recv();
    pool_->send_resets({2});
    EXPECT_EQ(recv(), List{2});
    expect_row(0, {0, 0, 0, 2, 0, /**/ 2, 0, -1});
  }
}

TEST_F(PoolTest, StepsSomeInTheirOrder) {
  reset();
  const Values actions{0.5, 0, -0.25, 0};
  const List environments{2, 0};
  pool_->step(actions.data(), environments.data(), 2, arrays_->batch());
  EXPECT_EQ(steps_of_all(), (std::vector<int>{1, 0, 1}));
  EXPECT_EQ(arrays_->rewards, (Values{0.5, -0.25, 0}));
  EXPECT_EQ(arrays_->steps, (List{1, 1, 0}));
}

TEST_F(PoolTest, RejectsCallsWhileEnvironmentsAreUnderWay) {
  make(AutoresetMode::next_step, 2);
  reset();
  send({0});
  const std::string receive_first = ": 1 environments are under way; receive them first";
  const std::string first = "environment 0: is under way; receive it first";
  const List both{1, 0};
  const std::pair<std::function<void()>, std::string> cases[] = {
      {[this] { step(); }, "step" + receive_first},
      {[this] { step_some({1}); }, "step" + receive_first},
      {[this] { reset({1}); }, "reset" + receive_first},
      {[&] { send(both); }, first},
      {[this] { pool_->send_resets({0}); }, first},
      {[this] { pool_->environment(0); }, first},
      {[this] { recv(); },
       "recv: 1 environments are under way; must be at least 2, the batch size"},
  };
  for (const auto& [call, message] : cases) EXPECT_EQ(message_of<std::logic_error>(call), message);
  EXPECT_NO_THROW(pool_->environment(1));
  send({1});
  recv();
  EXPECT_NO_THROW(step());
  EXPECT_EQ(steps_of_all(), (std::vector<int>{2, 2, 1}));
}

TEST_F(PoolTest, ReceivesFailedResets) {
  make(AutoresetMode::same_step);
  fakes_[1].length = 1;
  reset();
  fakes_[1].reset_fails = true;
  for (int round = 0; round < 2; ++round) {  // a failed reset, then another
    send({0, 1, 2});
    const List arrived = recv();
    EXPECT_STREQ(pool_->reset_error(1), "no ground");
    const std::size_t row = std::find(arrived.begin(), arrived.end(), 1U) - arrived.begin();
    EXPECT_EQ(arrays_->terminated[row], 1);
    EXPECT_EQ(arrays_->steps[row], 0U);
    EXPECT_EQ(arrays_->final_observations[2 * row + 1], round == 0 ? 1 : 0);
  }
  EXPECT_EQ(steps_of_all(), (std::vector<int>{2, 1, 2}));
  pool_->send_resets({1});
  send({0, 2});
  recv();
  EXPECT_STREQ(pool_->reset_error(1), "no ground");
}

TEST_F(PoolTest, EndsWithEnvironmentsUnderWay) {
  for (int i = 0; i < 100; ++i) {
    make(AutoresetMode::next_step);
    reset();
    send({0, 1, 2});
  }
}

TEST(PoolWorlds, AreRefusedTogether) {
  Pool pool([] { return make("Walker2d-v5"); }, {3, 1, AutoresetMode::next_step, 0});
  pool.set_world({}, {load_world("moon")});
  const World unknown{{"wind", {1, 1}}};
  EXPECT_NE(message_of<std::invalid_argument>([&] {
              pool.set_world({}, {World{}, World{}, unknown});
            }).find("world parameter wind = 1.0: unknown"),
            std::string::npos);
  EXPECT_EQ(message_of<std::invalid_argument>([&] {
              pool.set_world({}, {World{}, World{}});
            }),
            "2 worlds; must be 1, or 3, one per environment");
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(pool.environment(i).world(), load_world("moon"));
  pool.set_world({1}, {World{}});
  EXPECT_EQ(pool.environment(1).world(), World{});
  EXPECT_EQ(pool.environment(2).world(), load_world("moon"));
}

}  // namespace
}  // namespace walker
