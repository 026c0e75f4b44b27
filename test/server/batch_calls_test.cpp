// Batch calls without a master: what they show, count, report and refuse, and whose worlds are
// whose. pool_test.cpp has the rows, promises_test.py the bits.
#include "server/batch_calls.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <limits>
#include <optional>
#include <stdexcept>

#include "allocation_counter.h"
#include "bits.h"
#include "episode/fake_robot.h"
#include "error_message.h"
#include "ros/message_conversions.h"
#include "saved_states.h"
#include "walker_sim/registry.h"

namespace walker {
namespace {

using Indices = std::vector<std::uint32_t>;
using Messages = std::vector<walker_sim::World>;
using Values = std::vector<double>;

constexpr std::uint32_t kSize = 3;
constexpr std::uint32_t kShown = 1;
constexpr std::uint64_t kSeed = 11;
const World kGravity{{"gravity", {-12, -8}}};

MakeEnvironment maker(const std::string& id, std::int64_t max_episode_steps) {
  return [=] { return make(id, {{"max_episode_steps", max_episode_steps}}); };
}

/// The parts of a server that make batch calls.
struct BatchServer {
  explicit BatchServer(const MakeEnvironment& make, AutoresetMode mode = AutoresetMode::next_step,
                       const World& world = {}, std::uint32_t num_envs = kSize,
                       std::uint64_t seed = kSeed)
      : options(options_of(mode, world, num_envs, seed)),
        pool(make_pool(options, make)),
        calls(pool, options, account) {}

  static ServerOptions options_of(AutoresetMode mode, const World& world, std::uint32_t num_envs,
                                  std::uint64_t seed) {
    ServerOptions options{};
    options.mode = Mode::lockstep;
    options.seed = seed;
    options.num_envs = num_envs;
    options.num_threads = 2;
    options.autoreset_mode = mode;
    options.shown_environment = num_envs == 1 ? 0 : kShown;
    options.world = world;
    return options;
  }

  /// Resets each by the same seed.
  ResetBatch::Response reset(const Messages& worlds = {}, const Indices& listed = {}) {
    ResetBatch::Request request;
    request.environments = listed;
    request.worlds = worlds;
    request.seeds.assign(listed.empty() ? options.num_envs : listed.size(), kSeed);
    request.has_seed.assign(request.seeds.size(), 1);
    ResetBatch::Response response;
    calls.reset(request, response);
    return response;
  }

  void set(const Messages& worlds, const Indices& listed = {}) {
    SetWorld::Request request;
    request.environments = listed;
    request.worlds = worlds;
    calls.set_worlds(request);
  }

  const StepBatch::Response& step(const Values& actions) {
    calls.step(actions, reply);
    return reply;
  }

  ServerOptions options;
  Account account;
  Pool pool;
  BatchCalls calls;
  StepBatch::Response reply;
};

/// Topics show a step that ends an episode, before its autoreset.
TEST(BatchCalls, ShowTheSensorsOfAnEnvironmentAlone) {
  for (const char* id : {"BipedalWalker-v3", "Walker2d-v5"}) {
    SCOPED_TRACE(id);
    BatchServer server(maker(id, 60), AutoresetMode::same_step);
    Walker& shown = server.pool.walker(kShown);
    const std::unique_ptr<Environment> made = maker(id, 60)();
    Walker& alone = walker_of(*made);
    const auto expect_same = [&] {
      EXPECT_EQ(shown.state().step, alone.state().step);
      EXPECT_EQ(to_bits(look_at(shown)), to_bits(look_at(alone)));
    };
    const std::size_t size = shown.specification().action_size();
    Generator generator{1};
    server.reset();
    alone.reset(kSeed);
    int num_shown = 0;
    for (int i = 0; i < 200 && !HasFailure(); ++i) {
      Values actions(kSize * size);
      for (double& value : actions) value = generator.uniform(-1.5, 1.5);
      alone.step(&actions[kShown * size], size);
      server.calls.step(actions, server.reply, [&] {
        ++num_shown;
        expect_same();
      });
      if (alone.state().has_ended()) alone.reset(std::nullopt);
      expect_same();
    }
    EXPECT_EQ(num_shown, 200);
    EXPECT_GT(alone.state().episode, 2U);
  }
}

TEST(BatchCalls, FirstResetsHaveTheServersSeedPlusTheIndex) {
  Fakes<FakeRobot> fakes;
  BatchServer server(fakes, AutoresetMode::next_step, {}, kSize, ~std::uint64_t{0});
  ResetBatch::Response begun;
  server.calls.reset({}, begun);
  EXPECT_EQ(begun.info, (Values{-1, 0, 1}));  // the fake walker knows seeds below 100
}

struct BoundedRobot : FakeRobot {
  BoundedRobot() { specification_.action_high = {1, 1}; }
};

class FakeBatch : public testing::TestWithParam<AutoresetMode> {
 protected:
  Fakes<BoundedRobot> fakes_;
  BatchServer server_{fakes_, GetParam()};
  const Values still_ = Values(std::size_t{2} * kSize);
};

TEST_P(FakeBatch, CountsStepsResetsAndEpisodes) {
  fakes_[1].length = 2;
  server_.reset();
  server_.reset({}, {1});
  const Values actions{0, 0, 1.5, 0, 0, -1};
  server_.step(actions);
  server_.step(actions);
  const auto& counters = server_.account.counters;
  EXPECT_EQ(counters.steps, 6U);
  EXPECT_EQ(counters.clamped_commands, 2U);
  const auto summary = server_.account.episodes.summary();
  EXPECT_EQ(summary.episodes, 1U);
  EXPECT_EQ(summary.return_mean, 3);
  EXPECT_EQ(summary.length_mean, 2);
  if (GetParam() == AutoresetMode::next_step) server_.step(actions);  // not clamped
  EXPECT_EQ(counters.resets, GetParam() == AutoresetMode::disabled ? 4U : 5U);
  EXPECT_EQ(counters.clamped_commands, 2U);
}

TEST_P(FakeBatch, ReportsFailedResets) {
  const std::string message = "environment 1: the simulation failed at its reset: no ground";
  const auto& counters = server_.account.counters;
  fakes_[1].reset_fails = true;
  const ResetBatch::Response begun = server_.reset();
  EXPECT_EQ(begun.status_message, message);
  EXPECT_EQ(begun.observations, (Values{1, 0, 0, 0, 1, 0}));
  EXPECT_EQ(to_bits(begun.info),
            to_bits(Values{kSeed, std::numeric_limits<double>::quiet_NaN(), kSeed}));
  EXPECT_EQ(counters.resets, 3U);
  EXPECT_EQ(counters.simulation_errors, 1U);
  if (GetParam() == AutoresetMode::disabled) return;
  const bool is_same_step = GetParam() == AutoresetMode::same_step;
  EXPECT_EQ(server_.step(still_).status_message, message) << "it is repeated";
  EXPECT_EQ(server_.reply.episodes, (Indices{1, 2, 1}));
  EXPECT_EQ(server_.reply.steps, (Indices{1, 0, 1}));
  EXPECT_EQ(server_.reply.final_environments, is_same_step ? Indices{1} : Indices{});
  EXPECT_EQ(server_.reply.final_observations, is_same_step ? Values(2) : Values{});
  fakes_[1].reset_fails = false;
  EXPECT_EQ(server_.reset({}, {1}).status_message, "");
  EXPECT_EQ(server_.step(still_).status_message, "");

  // Autoresets
  fakes_[1].length = 2;
  fakes_[1].reset_fails = true;
  if (!is_same_step) {
    EXPECT_EQ(server_.step(still_).status_message, "");
  }
  EXPECT_EQ(server_.step(still_).status_message, message);
  EXPECT_EQ(counters.simulation_errors, 3U);
  EXPECT_EQ(server_.account.episodes.summary().episodes, 1U);
  EXPECT_EQ(server_.account.episodes.summary().failed, 0U);
  fakes_[1].reset_fails = false;
  EXPECT_EQ(server_.step(still_).status_message, "");
}

INSTANTIATE_TEST_SUITE_P(Modes, FakeBatch,
                         testing::Values(AutoresetMode::next_step, AutoresetMode::same_step,
                                         AutoresetMode::disabled),
                         [](const auto& instance) { return to_text(instance.param); });

TEST_F(AllocationTest, StepsWithAReusedResponseDoNotAllocate) {
  for (const std::uint32_t num_envs : {1U, 4U}) {
    BatchServer server(maker("Walker2d-v5", 1000), AutoresetMode::next_step, {}, num_envs);
    server.reset();
    const Values actions(num_envs * server.pool.specification().action_size(), 0.7);
    for (int i = 0; i < 500; ++i) server.step(actions);
    allocations = 0;
    const Counting counting;
    for (int i = 0; i < 500; ++i) server.step(actions);
    EXPECT_EQ(allocations, 0) << num_envs;
  }
}

walker_sim::World preset(const std::string& name) {
  walker_sim::World message;
  message.preset = name;
  return message;
}

template <typename Response>
Indices reported(const Response& response) {
  Indices environments;
  for (const auto& world : response.worlds) environments.push_back(world.environment);
  return environments;
}

class BatchWorlds : public testing::TestWithParam<const char*> {
 protected:
  BatchServer serve(const World& world = {}) {
    return BatchServer(maker(GetParam(), 4), AutoresetMode::next_step, world);
  }
  /// Observation of an environment alone in this world, after its reset.
  Values expected(const World& world) const {
    const auto alone = make(GetParam());
    alone->set_world(world);
    walker_of(*alone).reset(kSeed);
    return walker_of(*alone).state().observation;
  }
  void expect_observation(BatchServer& server, std::uint32_t environment, const World& world) {
    EXPECT_EQ(to_bits(server.pool.walker(environment).state().observation),
              to_bits(expected(world)))
        << "environment " << environment;
  }
};

TEST_P(BatchWorlds, ServersOwnHoldsForAll) {
  BatchServer server = serve(kGravity);
  const auto response = server.reset();
  EXPECT_EQ(reported(response), (Indices{0, 1, 2}));
  for (std::uint32_t i = 0; i < kSize; ++i) {
    walker_sim::World answered;
    answered.parameters = response.worlds[i].parameters;
    const World& drawn = server.pool.walker(i).state().drawn_world();
    EXPECT_EQ(to_world(answered), drawn);
    EXPECT_GT(drawn.at("gravity").low, -12);
    EXPECT_LT(drawn.at("gravity").high, -8);
    expect_observation(server, i, kGravity);
  }
  const Values actions(kSize * server.pool.specification().action_size());
  EXPECT_EQ(reported(server.step(actions)), Indices{}) << "without a reset";
}

TEST_P(BatchWorlds, ResetTakesOneForAllOrOneEach) {
  BatchServer server = serve();
  const World moon{{"gravity", {-1.62, -1.62}}};
  const World delayed{{"action_delay", {0.04, 0.04}}, {"joint_position_noise", {0.1, 0.1}}};
  walker_sim::World message;
  to_message(delayed, message);
  EXPECT_EQ(reported(server.reset()), Indices{});
  EXPECT_EQ(reported(server.reset({preset("moon")})), (Indices{0, 1, 2}));
  for (std::uint32_t i = 0; i < kSize; ++i) expect_observation(server, i, moon);
  // An empty one leaves the environment's own; each holds for the following resets too.
  const auto response = server.reset({message, {}, preset("gymnasium")}, {2, 0, 1});
  EXPECT_EQ(reported(response), (Indices{2, 0}));
  Values rows;
  for (const World& world : {delayed, moon, World{}}) {
    for (const double value : expected(world)) rows.push_back(value);
  }
  EXPECT_EQ(to_bits(response.observations), to_bits(rows)) << "not as listed";
  EXPECT_EQ(reported(server.reset({{}})), (Indices{0, 2}));
  expect_observation(server, 0, moon);
  expect_observation(server, 1, {});
  expect_observation(server, 2, delayed);
}

TEST_P(BatchWorlds, RefusalChangesNothing) {
  BatchServer server = serve(kGravity);
  server.reset();
  walker_sim::World wrong;
  wrong.parameters.resize(1);
  wrong.parameters[0].name = "dropout";
  wrong.parameters[0].low = wrong.parameters[0].high = 2;
  const walker_sim::World moon = preset("moon");
  const std::string is_wrong = "world parameter dropout = 2.0: must be in [0.0, 1.0]";
  const std::string is_empty =
      " is empty; must have a preset or parameters (Gymnasium's world is the preset gymnasium)";
  const std::string wrong_count = " values; must have 1 for all, or 3, one per environment";
  const struct {
    Messages worlds;
    Indices listed;
    std::string text;
  } refused[] = {
      {{wrong}, {}, is_wrong},
      {{moon, wrong}, {0, 1}, is_wrong},
      {{moon, moon}, {}, "worlds has 2" + wrong_count},
      {{moon}, {0, 3}, "environments[1] = 3; must be below num_envs = 3"},
      {{moon}, {0, 0}, "environments[1] = 0; must be listed once only"},
      {{}, {}, "worlds has 0" + wrong_count},
      {{moon, {}}, {0, 1}, "worlds[1]" + is_empty},
      {{{}}, {}, "worlds[0]" + is_empty},
  };
  for (const auto& each : refused) {
    EXPECT_EQ(message_of<std::invalid_argument>([&] { server.set(each.worlds, each.listed); }),
              each.text);
  }
  for (const auto& [worlds, text] :
       {std::make_pair(Messages{moon, wrong, moon}, is_wrong),
        std::make_pair(Messages{moon, moon}, "worlds has 2" + wrong_count)}) {
    EXPECT_EQ(message_of<std::invalid_argument>([&, &worlds = worlds] { server.reset(worlds); }),
              text);
  }
  for (std::uint32_t i = 0; i < kSize; ++i) {
    EXPECT_EQ(server.pool.walker(i).world(), kGravity);
    EXPECT_EQ(server.pool.walker(i).state().episode, 1U);
  }
}

INSTANTIATE_TEST_SUITE_P(Ids, BatchWorlds, testing::Values("BipedalWalker-v3", "Walker2d-v5"),
                         [](const auto& each) { return std::string(each.param, 8); });

}  // namespace
}  // namespace walker
