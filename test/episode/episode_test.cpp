#include "episode/episode.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "episode/fake_walker.h"
#include "error_message.h"

namespace walker {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

class EpisodeTest : public testing::Test {
 protected:
  void make(std::uint32_t limit) {
    auto fake = std::make_unique<FakeWalker>(limit);
    fake_ = fake.get();
    episode_ = std::make_unique<Episode>(std::move(fake));
  }

  void SetUp() override {
    make(3);
    result_.observation = observation_.data();
    result_.info = info_.data();
  }
  void reset() { episode_->reset(std::nullopt, result_); }
  void step(const std::vector<double>& action = {0, 0}) {
    episode_->step(action.data(), action.size(), result_);
  }
  std::string refused_action(const std::vector<double>& action) {
    return message_of<InvalidAction>([&] { step(action); });
  }

  FakeWalker* fake_ = nullptr;
  std::unique_ptr<Episode> episode_;
  std::array<double, 2> observation_{};
  std::array<double, 1> info_{1};
  Result result_;
};

TEST_F(EpisodeTest, RefusesAllCallsBeforeTheFirstReset) {
  Sensors sensors;
  Scene scene;
  EXPECT_EQ(message_of<ResetNeeded>([&] { step(); }), "step: there is no episode yet; reset first");
  EXPECT_EQ(message_of<ResetNeeded>([&] { episode_->sense(sensors); }),
            "sense: there is no episode yet; reset first");
  EXPECT_EQ(message_of<ResetNeeded>([&] { episode_->scene(scene); }),
            "scene: there is no episode yet; reset first");
  EXPECT_EQ(fake_->all_steps + fake_->num_senses, 0);
}

TEST_F(EpisodeTest, LimitTruncatesOnItsStep) {
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

TEST_F(EpisodeTest, LastStepMayTerminateAndTruncate) {
  reset();
  fake_->length = 3;
  for (int i = 0; i < 3; ++i) step();
  EXPECT_TRUE(result_.truncated);
  EXPECT_TRUE(result_.terminated);
  EXPECT_STREQ(result_.end_reason, "fell");
}

TEST_F(EpisodeTest, ZeroMeansNoLimit) {
  make(0);
  fake_->length = 0;  // never
  reset();
  for (int i = 0; i < 10000; ++i) {
    step();
    ASSERT_FALSE(result_.truncated);
  }
}

TEST_F(EpisodeTest, RefusesStepsAfterTheEnd) {
  reset();
  fake_->length = 2;
  step();
  step();
  EXPECT_EQ(message_of<ResetNeeded>([&] { step(); }),
            "step: the episode ended after 2 steps; reset first");
  EXPECT_EQ(fake_->all_steps, 2);
  Sensors sensors;
  EXPECT_NO_THROW(episode_->sense(sensors)) << "the last state can still be measured";
  reset();
  EXPECT_NO_THROW(step());
}

TEST_F(EpisodeTest, RefusesStepsAfterAFailedReset) {
  reset();
  fake_->reset_fails = true;
  EXPECT_THROW(reset(), std::runtime_error);
  Sensors sensors;
  EXPECT_EQ(message_of<ResetNeeded>([&] { step(); }), "step: the simulation failed; reset first");
  EXPECT_EQ(message_of<ResetNeeded>([&] { episode_->sense(sensors); }),
            "sense: the simulation failed; reset first");
  EXPECT_EQ(fake_->all_steps, 0);
}

TEST_F(EpisodeTest, AFailedStepEndsTheEpisode) {
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
  Sensors sensors;
  EXPECT_EQ(message_of<ResetNeeded>([&] { step(); }), "step: the simulation failed; reset first");
  EXPECT_EQ(message_of<ResetNeeded>([&] { episode_->sense(sensors); }),
            "sense: the simulation failed; reset first");
  EXPECT_EQ(fake_->all_steps, 0);
  reset();
  step();
  EXPECT_FALSE(result_.terminated);
}

TEST_F(EpisodeTest, RejectsMalformedActions) {
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

TEST_F(EpisodeTest, ContinuesFromAGivenGeneratorState) {
  EXPECT_EQ(episode_->generator_state(), GeneratorState{});
  const GeneratorState state = Generator(7).state();
  episode_->set_generator_state(state);
  EXPECT_EQ(episode_->generator_state(), state);
  reset();
  EXPECT_EQ(episode_->state().generator_state, state);
  EXPECT_THROW(episode_->set_generator_state({9, 8, 7, 6, 5, 4}), std::invalid_argument)
      << "an increment is odd";
}

}  // namespace
}  // namespace walker
