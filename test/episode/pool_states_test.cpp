// Saved states of pools: whose rows and worlds they replace, and how they are refused.
// test/promises shows that they continue.
#include <gtest/gtest.h>

#include <string>

#include "episode/fake_robot.h"
#include "episode/rollout.h"
#include "error_message.h"
#include "saved_states.h"

namespace walker {
namespace {

PoolOptions options_of(std::size_t num_envs) { return {num_envs, 1, AutoresetMode::next_step, 0}; }

TEST(PoolStates, EqualThoseOfSingleEnvironmentsInAnotherWorld) {
  Rollout rollout("Walker2d-v5", options_of(3));
  rollout.pool.set_world({}, {load_world("moon")});
  rollout.reset(1);
  Stepper single("Walker2d-v5", {{"max_episode_steps", std::int64_t{0}}});  // no limit
  World world = load_world("noisy");
  world["ground_roughness"] = {1, 2};
  single.environment->set_world(world);
  single.reset(7);
  const std::vector<double> action(6, 0.5);
  single.step(action);
  const std::vector<std::uint64_t> first = rollout.row(0);
  rollout.pool.load_states({2}, {save(single)}, rollout.arrays.batch());
  EXPECT_EQ(rollout.row(0), first) << "others' rows stay";
  EXPECT_EQ(rollout.arrays.steps[2], 1U);
  const auto* const row = &rollout.arrays.observations[2 * single.observation.size()];
  EXPECT_EQ(to_bits({row, row + single.observation.size()}), to_bits(single.observation));
  EXPECT_EQ(to_bits(rollout.arrays.rewards[2]), to_bits(single.result.reward));
  State state;
  rollout.pool.save_state(2, state);
  EXPECT_EQ(state, save(single));
  load(single, state);
  EXPECT_EQ(save(single), state);
}

TEST(PoolStates, ChangeNothingIfRejected) {
  Rollout rollout("Walker2d-v5", options_of(3));
  rollout.reset(1);
  const std::vector<State> before = rollout.save();
  Rollout another("Walker2d-v5", options_of(3));
  another.reset(5);
  std::vector<State> states = another.save();
  states[2][100] ^= std::byte{1};
  Pool& pool = rollout.pool;
  const Batch batch = rollout.arrays.batch();
  EXPECT_EQ(message_of<std::invalid_argument>([&] { pool.load_states({}, states, batch); }),
            "environment 2: the state is damaged: its checksum does not match");
  EXPECT_EQ(message_of<std::invalid_argument>([&] { pool.load_states({0}, states, batch); }),
            "3 states; must be 1, one per environment");
  EXPECT_EQ(message_of<std::invalid_argument>([&] {
              pool.load_states({0, 1, 0}, states, batch);
            }),
            "environment 0: listed twice");
  EXPECT_EQ(message_of<std::invalid_argument>([&] { pool.load_states({3}, {{}}, batch); }),
            "environment 3: must be in [0, 2]");
  EXPECT_EQ(rollout.save(), before);
}

TEST(PoolStates, AreNotSavedUnderWay) {
  Rollout rollout("Walker2d-v5", options_of(2));
  rollout.reset(1);
  const std::vector<State> states = rollout.save();
  const std::vector<double> actions(12, 0);
  const std::vector<std::uint32_t> both{0, 1};
  rollout.pool.send(actions.data(), both.data(), both.size());
  State state;
  EXPECT_THROW(rollout.pool.save_state(0, state), std::logic_error);
  EXPECT_THROW(rollout.pool.load_states({}, states, rollout.arrays.batch()), std::logic_error);
}

/// The state of an environment before its first reset needs a reset after loading, too.
TEST(PoolStates, NeedAResetIfSavedBeforeOne) {
  Rollout rollout("Hopper-v5", options_of(2));
  const std::vector<State> none = rollout.save();
  rollout.reset(1);
  rollout.pool.load_states({1}, {none[0]}, rollout.arrays.batch());
  const std::vector<double> actions(6, 0);
  EXPECT_THROW(rollout.pool.step(actions.data(), actions.size(), {}), ResetNeeded);
}

TEST(PoolStates, AreRefusedByTheEngine) {
  Fakes<> fakes;
  Pool pool(fakes, options_of(1));
  State state;
  EXPECT_THROW(pool.save_state(0, state), std::logic_error);
  EXPECT_THROW(pool.load_states({}, {state}, {}), std::logic_error);
}

}  // namespace
}  // namespace walker
