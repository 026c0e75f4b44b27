// Worlds of batch calls without a master: whose they are, what was drawn, and refusals.
#include <gtest/gtest.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "bits.h"
#include "error_message.h"
#include "ros/records.h"
#include "server/environments.h"
#include "walker_sim/registry.h"

namespace walker {
namespace {

using Indices = std::vector<std::uint32_t>;

constexpr std::uint32_t kSize = 3;
constexpr std::uint64_t kSeed = 11;
const World kGravity{{"gravity", {-12, -8}}};

walker_sim::World message_of_world(const World& world) {
  walker_sim::World message;
  to_message(world, message);
  return message;
}

walker_sim::World preset(const std::string& name) {
  walker_sim::World message;
  message.preset = name;
  return message;
}

/// Environments of a server, of episodes that end after four steps.
struct Batch3 {
  explicit Batch3(const std::string& id, AutoresetMode mode = AutoresetMode::next_step,
                  const World& world = {})
      : options(options_of(id, mode, world)),
        pool(make_pool(options,
                       [id] {
                         return make(id, {{"max_episode_steps", std::int64_t{4}}});
                       })),
        calls(pool, options, account) {}

  static ServerOptions options_of(const std::string& id, AutoresetMode mode, const World& world) {
    ServerOptions options{};
    options.id = id;
    options.mode = Mode::lockstep;
    options.seed = kSeed;
    options.num_envs = kSize;
    options.num_threads = 1;
    options.autoreset_mode = mode;
    options.world = world;
    return options;
  }

  ResetBatch::Response reset(const std::vector<walker_sim::World>& worlds = {},
                             const Indices& listed = {}) {
    ResetBatch::Request request;
    request.environments = listed;
    request.worlds = worlds;
    request.seeds.assign(listed.empty() ? kSize : listed.size(), kSeed);
    request.has_seed.assign(request.seeds.size(), 1);
    ResetBatch::Response response;
    calls.reset(request, response);
    return response;
  }

  void set(const std::vector<walker_sim::World>& worlds, const Indices& listed = {}) {
    SetWorld::Request request;
    request.environments = listed;
    request.worlds = worlds;
    calls.set_worlds(request);
  }

  const StepBatch::Response& step() {
    calls.step(std::vector<double>(kSize * pool.specification().action_size(), 0.5), reply);
    return reply;
  }

  /// Observations of an environment alone in this world, after its reset.
  std::vector<double> expected(const World& world) const {
    const auto alone = make(options.id, {{"max_episode_steps", std::int64_t{4}}});
    alone->set_world(world);
    episode_of(*alone).reset(kSeed);
    return episode_of(*alone).state().observation;
  }

  void expect_observation(std::uint32_t environment, const World& world) {
    EXPECT_EQ(to_bits(pool.episode(environment).state().observation), to_bits(expected(world)))
        << "environment " << environment;
  }

  ServerOptions options;
  Account account;
  Pool pool;
  BatchCalls calls;
  StepBatch::Response reply;
};

template <typename Response>
Indices reported(const Response& response) {
  Indices environments;
  for (const auto& world : response.worlds) environments.push_back(world.environment);
  return environments;
}

class BatchWorlds : public testing::TestWithParam<const char*> {};

TEST_P(BatchWorlds, ServersOwnHoldsForAll) {
  Batch3 batch(GetParam(), AutoresetMode::next_step, kGravity);
  const auto response = batch.reset();
  EXPECT_EQ(reported(response), (Indices{0, 1, 2}));
  for (std::uint32_t i = 0; i < kSize; ++i) {
    const WorldValues& drawn = *batch.pool.episode(i).state().world;
    EXPECT_EQ(to_values(response.worlds[i].parameters), drawn);
    EXPECT_GT(drawn.at("gravity"), -12);
    EXPECT_LT(drawn.at("gravity"), -8);
    batch.expect_observation(i, kGravity);
  }
}

TEST_P(BatchWorlds, ResetTakesOneForAllOrOneEach) {
  Batch3 batch(GetParam());
  const World moon{{"gravity", {-1.62, -1.62}}};
  const World delayed{{"action_delay", {0.04, 0.04}}, {"joint_position_noise", {0.1, 0.1}}};
  EXPECT_EQ(reported(batch.reset()), Indices{});
  EXPECT_EQ(reported(batch.reset({preset("moon")})), (Indices{0, 1, 2}));
  for (std::uint32_t i = 0; i < kSize; ++i) batch.expect_observation(i, moon);
  // An empty one leaves the environment's own; each holds for the following resets too.
  const auto response =
      batch.reset({message_of_world(delayed), {}, preset("gymnasium")}, {2, 0, 1});
  EXPECT_EQ(reported(response), (Indices{2, 0}));
  for (int i = 0; i < 2; ++i) {
    batch.expect_observation(0, moon);
    batch.expect_observation(1, {});
    batch.expect_observation(2, delayed);
    batch.reset();
  }
  EXPECT_EQ(reported(batch.reset({{}})), (Indices{0, 2}));
}

TEST_P(BatchWorlds, AStepReportsTheWorldsThatItsResetsDraw) {
  for (const AutoresetMode mode : {AutoresetMode::next_step, AutoresetMode::same_step}) {
    Batch3 batch(GetParam(), mode);
    batch.reset();
    batch.set({message_of_world(kGravity)}, {1});
    for (int step = 1; step < 4; ++step) EXPECT_EQ(reported(batch.step()), Indices{});
    batch.step();
    if (mode == AutoresetMode::next_step) {
      EXPECT_EQ(reported(batch.reply), Indices{});
      batch.step();
    }
    EXPECT_EQ(reported(batch.reply), (Indices{1}));
    EXPECT_EQ(reported(batch.step()), Indices{});
  }
}

TEST_P(BatchWorlds, RefusalChangesNothing) {
  Batch3 batch(GetParam(), AutoresetMode::next_step, kGravity);
  batch.reset();
  walker_sim::World wrong;
  wrong.parameters.resize(1);
  wrong.parameters[0].name = "dropout";
  wrong.parameters[0].low = wrong.parameters[0].high = 2;
  const walker_sim::World moon = preset("moon");
  const std::string is_wrong = "world parameter dropout = 2.0: must be in [0.0, 1.0]";
  const std::string is_empty =
      " is empty; must have a preset or parameters (Gymnasium's world is the preset gymnasium)";
  const std::string is_too_many =
      "worlds has 2 values; must have 1 for all, or 3, one per environment";
  const auto refusal = [&](const std::vector<walker_sim::World>& worlds,
                           const Indices& listed = {}) {
    return message_of<std::invalid_argument>([&] { batch.set(worlds, listed); });
  };
  const auto reset_refusal = [&](const std::vector<walker_sim::World>& worlds) {
    return message_of<std::invalid_argument>([&] { batch.reset(worlds); });
  };
  EXPECT_EQ(refusal({wrong}), is_wrong);
  EXPECT_EQ(refusal({moon, wrong}, {0, 1}), is_wrong);
  EXPECT_EQ(refusal({moon, moon}), is_too_many);
  EXPECT_EQ(refusal({}), "worlds has 0 values; must have 1 for all, or 3, one per environment");
  EXPECT_EQ(refusal({moon, {}}, {0, 1}), "worlds[1]" + is_empty);
  EXPECT_EQ(refusal({{}}), "worlds[0]" + is_empty);
  EXPECT_EQ(refusal({moon}, {0, 3}), "environments[1] = 3; must be below num_envs = 3");
  EXPECT_EQ(refusal({moon}, {0, 0}),
            "environments[1] = 0; is listed before, and each may be listed once");
  EXPECT_EQ(reset_refusal({moon, wrong, moon}), is_wrong);
  EXPECT_EQ(reset_refusal({moon, moon}), is_too_many);
  for (std::uint32_t i = 0; i < kSize; ++i) {
    EXPECT_EQ(batch.pool.episode(i).world(), kGravity);
    EXPECT_EQ(batch.pool.episode(i).state().episode, 1U);
  }
}

INSTANTIATE_TEST_SUITE_P(Ids, BatchWorlds, testing::Values("BipedalWalker-v3", "Walker2d-v5"),
                         [](const auto& each) { return std::string(each.param, 8); });

}  // namespace
}  // namespace walker
