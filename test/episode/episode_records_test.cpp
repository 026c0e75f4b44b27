#include "episode/walker.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "base/random.h"
#include "bits.h"
#include "cramped_walker.h"
#include "episode/fake_robot.h"
#include "error_message.h"
#include "restorable.h"
#include "test_name.h"
#include "walker_sim/registry.h"

namespace walker {
namespace {

Restorable simulation_of(const std::string& id, const Parameters& parameters = {}) {
  return {[=] { return make(id, parameters); }, 3};
}

std::vector<double> random_action(Generator& generator, const Restorable& simulation) {
  std::vector<double> action(simulation.specification().action_size());
  for (double& value : action) value = generator.uniform(-1.2, 1.2);
  return action;
}

void play(Restorable& simulation, int steps, std::uint64_t seed) {
  Generator generator(seed);
  for (int i = 0; i < steps && !simulation.state().has_ended(); ++i) {
    simulation.step(random_action(generator, simulation));
  }
}

void expect_same_sensors(const Sensors& one, const Sensors& other) {
  EXPECT_EQ(to_bits(one.joint_position), to_bits(other.joint_position));
  EXPECT_EQ(to_bits(one.joint_velocity), to_bits(other.joint_velocity));
  EXPECT_EQ(to_bits(one.joint_effort), to_bits(other.joint_effort));
  EXPECT_EQ(one.linear_velocity, other.linear_velocity);
  EXPECT_EQ(one.angular_velocity, other.angular_velocity);
  EXPECT_EQ(one.linear_acceleration, other.linear_acceleration);
  EXPECT_EQ(to_bits(one.ranges), to_bits(other.ranges));
  EXPECT_EQ(one.contacts, other.contacts);
}

/// Steps both to the end and into the next episode, and compares every bit.
void expect_same_future(Restorable& one, Restorable& other) {
  expect_same_state(one.state(), other.state());
  Generator generator(17);
  for (int i = 0; i < 2000 && !one.state().has_ended() && !testing::Test::HasFailure(); ++i) {
    const std::vector<double> action = random_action(generator, one);
    one.step(action);
    other.step(action);
    expect_same_state(one.state(), other.state());
    expect_same_sensors(one.sensors(), other.sensors());
  }
  EXPECT_TRUE(one.state().has_ended());
  one.reset(std::nullopt);
  other.reset(std::nullopt);
  expect_same_state(one.state(), other.state());
}

class AnyWalker : public testing::TestWithParam<const char*> {};

TEST_P(AnyWalker, GoesBackToItsOwnPastAsOftenAsWanted) {
  for (const int steps : {0, 10}) {
    Restorable simulation = simulation_of(GetParam());
    simulation.reset(4);
    play(simulation, steps, 1);
    const EpisodeRecord record = simulation.record();
    const EpisodeState state = simulation.state();
    const Sensors sensors = simulation.sensors();
    for (int i = 0; i < 3; ++i) {
      play(simulation, 20, 2 + i);
      simulation.restore(record);
      expect_same_state(simulation.state(), state);
      expect_same_sensors(simulation.sensors(), sensors);
      EXPECT_EQ(simulation.state().episode, 2U + i) << "a restore counts as a reset";
      EXPECT_EQ(to_bits(simulation.record().actions), to_bits(record.actions));
      EXPECT_EQ(simulation.record().checksums, record.checksums);
    }
  }
}

TEST_P(AnyWalker, AnEndedEpisodeWithoutChecksumsIsRestoredAsEnded) {
  Restorable original = simulation_of(GetParam(), {{"max_episode_steps", std::int64_t{5}}});
  original.reset(4);
  play(original, 5, 1);
  ASSERT_EQ(original.state().end_reason, "truncated: 5 steps");
  Restorable restarted = simulation_of(GetParam(), {{"max_episode_steps", std::int64_t{5}}});
  EpisodeRecord record = original.record();
  record.checksums.clear();  // nothing to compare
  restarted.restore(record);
  EXPECT_EQ(restarted.record().checksums, original.record().checksums);
  expect_same_future(original, restarted);
  EXPECT_EQ(restarted.state().step, 0U);
}

TEST_P(AnyWalker, ARefusedRecordChangesNothing) {
  Restorable simulation = simulation_of(GetParam());
  simulation.reset(4);
  play(simulation, 10, 1);
  const EpisodeRecord good = simulation.record();
  const EpisodeState state = simulation.state();
  const auto refusal = [&](const EpisodeRecord& record) {
    return message_of<std::exception>([&] { simulation.restore(record); });
  };

  EpisodeRecord bad = good;
  bad.engine = "another";
  EXPECT_EQ(refusal(bad).find("engine = another"), 0U);
  bad = good;
  bad.actions[3] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(refusal(bad).find("step 1 of the record: action[3]"), 0U) << refusal(bad);
  bad = good;
  bad.checksums[4] ^= 1U;
  EXPECT_EQ(refusal(bad), "step 4 of the record: checksum = " + std::to_string(bad.checksums[4]) +
                              "; repeated here it is " + std::to_string(good.checksums[4]));
  bad = good;
  bad.seed.reset();
  bad.generator_state[3] = 2;
  EXPECT_NE(refusal(bad).find("must be odd"), std::string::npos) << refusal(bad);
  bad = good;  // has steps after the episode's end
  const std::size_t size = simulation.specification().action_size();
  bad.num_steps = 3000;
  bad.actions.assign(bad.num_steps * size, 1);
  bad.checksums.clear();
  EXPECT_NE(refusal(bad).find("the episode ended"), std::string::npos) << refusal(bad);

  expect_same_state(simulation.state(), state);
  Restorable twin = simulation_of(GetParam());
  twin.restore(good);
  expect_same_future(simulation, twin);
}

/// As EpisodeRecord.msg defines them.
TEST_P(AnyWalker, ChecksumsCoverEveryTransition) {
  Restorable simulation = simulation_of(GetParam());
  Generator generator(1);
  std::vector<std::uint64_t> expected;
  std::uint64_t checksum = 0xcbf29ce484222325;
  const auto add = [&](std::uint64_t word) {
    checksum = (checksum ^ word) * 0x100000001b3;
    checksum = checksum ^ (checksum >> 32U);
  };
  simulation.reset(4);
  const EpisodeState& state = simulation.state();
  for (;;) {
    add(state.step);
    for (const double value : state.observation) add(to_bits(value));
    add(to_bits(state.reward));
    add(static_cast<std::uint64_t>(state.terminated));
    add(static_cast<std::uint64_t>(state.truncated));
    for (const double value : state.info) add(to_bits(value));
    expected.push_back(checksum);
    if (state.has_ended()) break;
    simulation.step(random_action(generator, simulation));
  }
  const EpisodeRecord record = simulation.record();
  EXPECT_EQ(record.checksums, expected);
  EXPECT_EQ(record.checksums.size(), record.num_steps + 1U);
}

constexpr std::chrono::steady_clock::time_point kAtOnce{};

TEST_P(AnyWalker, ARestoreInPiecesLeavesThePresentEpisodeAloneAndIsTheSame) {
  Restorable original = simulation_of(GetParam());
  original.reset(4);
  play(original, 20, 1);
  const EpisodeRecord record = original.record();
  Restorable simulation = simulation_of(GetParam());
  Restorable undisturbed = simulation_of(GetParam());
  for (Restorable* each : {&simulation, &undisturbed}) each->reset(5);
  simulation.begin_restore(record);
  Generator generator(2);
  for (std::uint32_t i = 1; i < record.num_steps; ++i) {
    ASSERT_FALSE(simulation.go_on_restoring(kAtOnce)) << i;
    const std::vector<double> action = random_action(generator, simulation);
    for (Restorable* each : {&simulation, &undisturbed}) {
      if (i == 10) {
        each->reset(6);  // an episode begins during the restore
      } else {
        each->step(action);
      }
    }
    expect_same_state(simulation.state(), undisturbed.state());
    expect_same_sensors(simulation.sensors(), undisturbed.sensors());
  }
  ASSERT_TRUE(simulation.go_on_restoring(kAtOnce));
  expect_same_state(simulation.state(), undisturbed.state());
  simulation.finish_restore();
  EXPECT_EQ(simulation.state().episode, 3U) << "a restore counts as a reset";
  Restorable twin = simulation_of(GetParam());
  twin.reset(1);
  twin.reset(1);
  twin.restore(record);
  expect_same_future(simulation, twin);
}

TEST_P(AnyWalker, ARestoreThatIsGivenUpLeavesNothingBehind) {
  Restorable simulation = simulation_of(GetParam());
  simulation.reset(4);
  play(simulation, 10, 1);
  const EpisodeRecord record = simulation.record();
  simulation.reset(5);
  play(simulation, 10, 2);
  const EpisodeRecord other = simulation.record();
  simulation.begin_restore(record);
  EXPECT_FALSE(simulation.go_on_restoring(kAtOnce));
  simulation.restore(other);
  Restorable twin = simulation_of(GetParam());
  twin.reset(1);
  twin.reset(1);
  twin.restore(other);
  expect_same_future(simulation, twin);
}

INSTANTIATE_TEST_SUITE_P(Ids, AnyWalker,
                         testing::Values("BipedalWalker-v3", "BipedalWalkerHardcore-v3",
                                         "Walker2d-v4", "Walker2d-v5"),
                         kNameOfId);

TEST(EpisodeRecords, HasNoneBeforeTheFirstResetAndWhereEpisodesDependOnEarlierOnes) {
  Restorable simulation = simulation_of("BipedalWalker-v3", {{"reuse_world", true}});
  const auto refusal = [&] { return message_of<std::exception>([&] { simulation.record(); }); };
  EXPECT_EQ(refusal(), "there is no episode yet; reset first");
  simulation.reset(1);
  EXPECT_NE(refusal().find("reuse_world"), std::string::npos);
}

TEST(EpisodeRecords, TheWorldOfARecordIsThatOfItsEpisodeOnly) {
  Restorable original = simulation_of("Walker2d-v5");
  World world = load_world("walker2d_rough");
  world.merge(load_world("noisy"));
  original.set_world(world);
  original.reset(4);
  play(original, 10, 1);
  Restorable other = simulation_of("Walker2d-v5");
  other.set_world(load_world("moon"));
  other.restore(original.record());
  expect_same_state(other.state(), original.state());
  EXPECT_EQ(other.state().drawn_world(), original.state().drawn_world());
  expect_same_sensors(other.sensors(), original.sensors());
  EXPECT_EQ(other.world(), load_world("moon"));
  other.reset(std::nullopt);
  EXPECT_EQ(other.state().drawn_world(), load_world("moon"));
}

/// A reset at which the engine fails is reported like a failed step.
TEST(EpisodeRecords, AResetThatFailsIsAnEpisodeThatHasEnded) {
  const CrampedWalker cramped;
  Restorable simulation(std::ref(cramped), cramped.good_seed());
  simulation.reset(std::nullopt);
  play(simulation, 3, 1);
  const std::uint64_t bad = cramped.bad_seed();
  simulation.reset(bad);
  const EpisodeState& state = simulation.state();
  EXPECT_TRUE(state.failed_at_reset());
  EXPECT_EQ(state.error, "MuJoCo: Stack overflow");
  EXPECT_EQ(state.end_reason, "terminated: the simulation failed at its reset");
  EXPECT_EQ(state.episode, 2U);
  EXPECT_EQ(state.step, 0U);
  EXPECT_EQ(state.seed, bad);
  EXPECT_EQ(state.generator_state, Generator(bad).state());
  EXPECT_TRUE(state.action.empty());
  EXPECT_EQ(state.observation, std::vector<double>(state.observation.size()));
  EXPECT_TRUE(std::all_of(state.info.begin(), state.info.end(),
                          [](double value) { return std::isnan(value); }));
  EXPECT_EQ(state.episode_return, 0);
  EXPECT_EQ(message_of<ResetNeeded>([&] { simulation.step(std::vector<double>(6)); }),
            "step: the simulation failed; reset first");
  EXPECT_EQ(message_of<std::logic_error>([&] { simulation.record(); }),
            "there is no episode: the simulation failed at its reset; reset first");
  EXPECT_EQ(state.step, 0U);
}

TEST(EpisodeRecords, ARecordWhoseResetFailsChangesNothing) {
  const CrampedWalker cramped;
  Restorable simulation(std::ref(cramped), cramped.good_seed());
  simulation.reset(std::nullopt);
  EpisodeRecord record = simulation.record();
  record.seed = cramped.bad_seed();
  record.generator_state = Generator(*record.seed).state();
  EXPECT_EQ(message_of<std::invalid_argument>([&] { simulation.restore(record); }),
            "the reset of the record: MuJoCo: Stack overflow");
  EXPECT_EQ(simulation.state().episode, 1U);
  EXPECT_EQ(simulation.state().error, "");
  simulation.step(std::vector<double>(6));
}

TEST(EpisodeRecords, HasNoRecordOfAnEndlessEpisodeAndRefusesOne) {
  const auto endless = [] {
    auto walker = std::make_unique<FakeRobot>();
    walker->length = 0;
    return std::make_unique<Walker>(std::move(walker));
  };
  Restorable simulation(endless, 1);
  simulation.reset(1);
  const std::vector<double> action{0.5, 0.5};
  for (std::uint32_t i = 0; i < kMaxRecordedSteps; ++i) simulation.step(action);
  const EpisodeRecord longest = simulation.record();
  EXPECT_EQ(longest.actions.size(), 2 * kMaxRecordedSteps);
  simulation.step(action);
  EXPECT_EQ(message_of<std::logic_error>([&] { simulation.record(); }),
            "the episode has 1000001 steps; a record can have at most 1000000");
  simulation.reset(1);
  EXPECT_TRUE(simulation.record().actions.empty()) << "the next one has a record again";
  EpisodeRecord longer = longest;
  ++longer.num_steps;
  longer.actions.insert(longer.actions.end(), action.begin(), action.end());
  longer.checksums.clear();
  EXPECT_EQ(message_of<std::invalid_argument>([&] { simulation.restore(longer); }),
            "the record has 1000001 steps; must have at most 1000000");
  EXPECT_EQ(simulation.state().episode, 2U);
  simulation.restore(longest);
  EXPECT_EQ(simulation.record().actions, longest.actions);
}

}  // namespace
}  // namespace walker
