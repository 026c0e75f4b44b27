#include "episode/walker.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

#include "base/engine_release.h"
#include "episode/fake_robot.h"
#include "error_message.h"
#include "walker_sim/registry.h"

namespace walker {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

class WalkerTest : public testing::Test {
 protected:
  void make(std::uint32_t limit) {
    auto fake = std::make_unique<FakeRobot>(limit);
    fake_ = fake.get();
    walker_ = std::make_unique<Walker>(std::move(fake));
  }

  void SetUp() override {
    make(3);
    result_.observation = observation_.data();
    result_.info = info_.data();
  }
  void reset() { walker_->reset(std::nullopt, result_); }
  void step(const std::vector<double>& action = {0, 0}) {
    walker_->step(action.data(), action.size(), result_);
  }
  std::string refused_action(const std::vector<double>& action) {
    return message_of<InvalidAction>([&] { step(action); });
  }
  void expect_refusals(const std::string& reason) {
    const int steps = fake_->all_steps;
    Sensors sensors;
    Scene scene;
    EXPECT_EQ(message_of<ResetNeeded>([&] { step(); }), "step: " + reason + "; reset first");
    EXPECT_EQ(message_of<ResetNeeded>([&] { walker_->sense(sensors); }),
              "sense: " + reason + "; reset first");
    EXPECT_EQ(message_of<ResetNeeded>([&] { walker_->scene(scene); }),
              "scene: " + reason + "; reset first");
    EXPECT_EQ(fake_->all_steps, steps);
    EXPECT_EQ(fake_->num_senses, 0);
  }

  FakeRobot* fake_ = nullptr;
  std::unique_ptr<Walker> walker_;
  std::array<double, 2> observation_{};
  std::array<double, 1> info_{1};
  Result result_;
};

TEST_F(WalkerTest, RefusesAllCallsBeforeAResetThatSucceeds) {
  expect_refusals("there is no episode yet");
  reset();
  fake_->reset_fails = true;
  EXPECT_THROW(reset(), std::runtime_error);
  expect_refusals("the simulation failed");
}

TEST_F(WalkerTest, LimitTruncatesOnItsStep) {
  for (int episode = 0; episode < 2; ++episode) {
    reset();
    step();
    step();
    EXPECT_FALSE(result_.truncated);
    EXPECT_STREQ(result_.end_reason, "");
    step();
    EXPECT_TRUE(result_.truncated);
    EXPECT_FALSE(result_.terminated);
    EXPECT_STREQ(result_.end_reason, "3 steps");
  }
}

TEST_F(WalkerTest, LastStepMayTerminateAndTruncate) {
  reset();
  fake_->length = 3;
  for (int i = 0; i < 3; ++i) step();
  EXPECT_TRUE(result_.truncated);
  EXPECT_TRUE(result_.terminated);
  EXPECT_STREQ(result_.end_reason, "fell");
}

TEST_F(WalkerTest, ZeroMeansNoLimit) {
  make(0);
  fake_->length = 0;  // never
  reset();
  for (int i = 0; i < 10000; ++i) {
    step();
    ASSERT_FALSE(result_.truncated);
  }
}

TEST_F(WalkerTest, RefusesStepsAfterTheEnd) {
  reset();
  fake_->length = 2;
  step();
  step();
  EXPECT_EQ(message_of<ResetNeeded>([&] { step(); }),
            "step: the episode ended after 2 steps; reset first");
  EXPECT_EQ(fake_->all_steps, 2);
  Sensors sensors;
  EXPECT_NO_THROW(walker_->sense(sensors)) << "the last state can still be measured";
  reset();
  EXPECT_NO_THROW(step());
}

TEST_F(WalkerTest, AFailedStepEndsTheEpisode) {
  reset();
  fake_->step_fails = true;
  step();
  EXPECT_TRUE(result_.terminated);
  EXPECT_FALSE(result_.truncated);
  EXPECT_STREQ(result_.end_reason, "the simulation failed");
  EXPECT_STREQ(result_.error, "the engine gave up");
  EXPECT_EQ(result_.reward, 0);
  EXPECT_EQ(observation_, (std::array<double, 2>{1, 0})) << "unchanged";
  EXPECT_TRUE(std::isnan(info_[0]));
  fake_->step_fails = false;
  expect_refusals("the simulation failed");
  reset();
  step();
  EXPECT_FALSE(result_.terminated);
}

TEST_F(WalkerTest, RejectsMalformedActions) {
  reset();
  EXPECT_EQ(refused_action({}), "action has 0 values; must have 2, one per joint");
  EXPECT_EQ(refused_action({0}), "action has 1 values; must have 2, one per joint");
  EXPECT_EQ(refused_action({0, 0, 0}), "action has 3 values; must have 2, one per joint");
  EXPECT_EQ(refused_action({0, kNan}), "action[1] (knee) = nan; must be finite");
  EXPECT_EQ(refused_action({0, -kInfinity}), "action[1] (knee) = -inf; must be finite");
  EXPECT_EQ(refused_action({kInfinity, 0}), "action[0] (hip) = inf; must be finite");
  EXPECT_EQ(fake_->all_steps, 0);
  step();
  step();
  EXPECT_FALSE(result_.truncated) << "rejected steps do not count";
}

TEST_F(WalkerTest, ContinuesFromAGivenGeneratorState) {
  EXPECT_EQ(walker_->generator_state(), GeneratorState{});
  const GeneratorState state = Generator(7).state();
  walker_->set_generator_state(state);
  EXPECT_EQ(walker_->generator_state(), state);
  reset();
  EXPECT_EQ(walker_->state().generator_state, state);
  EXPECT_THROW(walker_->set_generator_state({9, 8, 7, 6, 5, 4}), std::invalid_argument)
      << "an increment is odd";
}

TEST(EpisodeInAWorld, ObservesFromTheStateThatIsSet) {
  const auto episode = make_walker("Walker2d-v5");
  episode->set_world(World{{"observation_delay", {0.024, 0.024}}});
  episode->reset(1);
  const std::vector<double> action(6, 0.1);
  for (int i = 0; i < 5; ++i) episode->step(action);
  std::vector<double> position(9, 0);
  position[1] = 1.5;
  episode->set_coordinates(position, std::vector<double>(9, 0));
  const std::vector<double> first = episode->state().observation;
  EXPECT_EQ(first[0], 1.5);
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(episode->state().observation, first) << i;
    episode->step(action);
  }
  EXPECT_EQ(episode->state().observation, first);
  episode->step(action);
  EXPECT_NE(episode->state().observation, first);
}

std::string refusal(const EpisodeRecord& record, const Specification& specification) {
  return message_of<std::invalid_argument>([&] { check_repeatable(record, specification); });
}

std::string refusal_of(const std::string& name, const std::string& recorded,
                       const std::string& own) {
  return "parameter " + name + " = " + recorded + " in the record; here it is " + own;
}

class EpisodeRecordTest : public testing::Test {
 protected:
  EpisodeRecordTest() : record_(describe_origin(specification_)) {
    record_.seed = 5;
    record_.generator_state = Generator(5).state();
    record_.num_steps = 1;
    record_.actions = {1, 2, 3, 4, 5, 6};
  }

  std::string refusal() const { return walker::refusal(record_, specification_); }

  Specification specification_ = make("Walker2d-v5")->specification();
  EpisodeRecord record_;
};

TEST_F(EpisodeRecordTest, RefusalsNameTheFieldAndBothValues) {
  const std::string release = engine_release(specification_.engine_version);
  static const std::vector<double> kNine(9);
  const std::pair<std::function<void(EpisodeRecord&)>, std::string> cases[] = {
      {[](auto& /*record*/) {}, "nothing thrown"},
      {[](auto& r) {  // the generator continues
         r.seed.reset();
         r.generator_state = Generator(6).state();
         r.num_steps = 0;
         r.actions.clear();
       },
       "nothing thrown"},
      {[](auto& r) { r.id = "Walker2d-v4"; },
       "id = Walker2d-v4 in the record; here it is Walker2d-v5"},
      {[](auto& r) { r.engine = "another engine"; },
       "engine = another engine in the record; here it is MuJoCo"},
      {[](auto& r) { r.engine_version = "9"; },
       "engine_version = 9 in the record; here it is " + release},
      {[&](auto& r) { r.engine_version = release + ", stepped by hand"; }, "nothing thrown"},
      {[&](auto& r) { r.engine_version = release + ", libm: another, stepped by hand"; },
       "libm = another in the record; here it is " +
           variant_of(specification_.engine_version, kLibm)},
      // Written by a release that did not record libm.
      {[&](auto& r) { r.engine_version = release; }, "nothing thrown"},
      // Written by a release whose levels were boxes.
      {[&](auto& r) {
         r.engine_version = release;
         r.world = {{"pit_gap", {1, 1}}};
       },
       "levels = boxes in the record; here it is lines"},
      {[](auto& r) { r.seed = 6; }, "generator_state is not that of seed = 6"},
      {[](auto& r) { r.actions.pop_back(); }, "actions has 5 values; must have 6, 1 steps of 6"},
      {[](auto& r) {
         r.actions.clear();
         r.num_steps = 4294967295;
       },
       "actions has 0 values; must have 25769803770, 4294967295 steps of 6"},
      {[](auto& r) {
         r.checksums = {1, 2};
       },
       "nothing thrown"},
      {[](auto& r) {
         r.coordinates = {{0, kNine, kNine}, {0, kNine, kNine}, {1, kNine, kNine}};
       },
       "nothing thrown"},
      {[](auto& r) {
         r.coordinates = {{2, kNine, kNine}};
       },
       "coordinates[0].step = 2; must be in [0, 1]"},
      {[](auto& r) {
         r.coordinates = {{1, kNine, kNine}, {0, kNine, kNine}};
       },
       "coordinates[1].step = 0; must be in [1, 1]"},
      {[](auto& r) {
         r.coordinates = {{1, kNine, {0}}};
       },
       "coordinates[0]: qvel has 1 values; must have 9, one per coordinate"},
      {[](auto& r) {
         r.coordinates = {{1, kNine, kNine}};
         r.coordinates[0].position[4] = NAN;
       },
       "coordinates[0]: qpos[4] = nan; must be finite"},
      {[](auto& r) { r.checksums = {1}; }, "checksums has 1 values; must have none or 2"},
  };
  for (const auto& [change, reason] : cases) {
    EpisodeRecord changed = record_;
    change(changed);
    EXPECT_EQ(walker::refusal(changed, specification_), reason);
  }
}

TEST_F(EpisodeRecordTest, WhatIsSaidOfALongTextIsShort) {
  record_.id.assign(10000000, 'a');
  EXPECT_LT(refusal().size(), 300U);
}

TEST_F(EpisodeRecordTest, EveryParameterCounts) {
  ASSERT_GT(record_.parameters.size(), 5U);
  for (std::size_t i = 0; i < record_.parameters.size(); ++i) {
    EpisodeRecord other = record_;
    other.parameters[i].second += '1';
    const auto& [name, value] = record_.parameters[i];
    EXPECT_EQ(walker::refusal(other, specification_), refusal_of(name, value + "1", value));
    other.parameters.erase(other.parameters.begin() + static_cast<std::ptrdiff_t>(i));
    EXPECT_EQ(walker::refusal(other, specification_), refusal_of(name, "(absent)", value));
  }
  EpisodeRecord twice = record_;
  twice.parameters.push_back(twice.parameters.front());
  EXPECT_EQ(walker::refusal(twice, specification_),
            "parameter xml_file is given twice in the record");
  record_.parameters.emplace_back("wind", "3");
  EXPECT_EQ(refusal(), "parameter wind = 3 in the record; here it is (absent)");
}

}  // namespace
}  // namespace walker
