#include "episode/episode.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "bare_robot.h"
#include "error_message.h"

namespace walker {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

class Fake : public BareRobot {
 public:
  explicit Fake(std::uint32_t limit) {
    specification_.max_episode_steps = limit;
    specification_.action_low = {-1, -1};
    specification_.joints.resize(2);
    specification_.joints[1].name = "knee";
    specification_.info_names = {"x", "z"};
    specification_.observation_low = {0};
  }

  void reset(Generator& /*generator*/, double* /*info*/) override {
    if (reset_fails) throw std::runtime_error("the engine");
  }
  void step(RobotStep& step) override {
    ++steps;
    if (step_fails) throw std::runtime_error("the engine gave up");
    step.terminated = terminates;
    step.end_reason = terminates ? "fell" : "";
  }
  void observe(double* observation) const override { observation[0] = steps + 3; }
  void sense(Sensors& /*sensors*/) override { ++senses; }

  bool reset_fails = false;
  bool step_fails = false;
  bool terminates = false;
  int steps = 0;
  int senses = 0;
};

class EpisodeTest : public testing::Test {
 protected:
  void limit_to(std::uint32_t limit) {
    auto fake = std::make_unique<Fake>(limit);
    fake_ = fake.get();
    episode_ = std::make_unique<Episode>(std::move(fake));
  }

  void SetUp() override {
    limit_to(3);
    result_.observation = &observation_;
    result_.info = info_.data();
  }
  void reset() { episode_->reset(std::nullopt, result_); }
  void step(const std::vector<double>& action = {0, 0}) {
    episode_->step(action.data(), action.size(), result_);
  }
  std::string refused_action(const std::vector<double>& action) {
    return message_of<InvalidAction>([&] { step(action); });
  }

  Fake* fake_ = nullptr;
  std::unique_ptr<Episode> episode_;
  double observation_ = 0;
  std::array<double, 2> info_{1, 2};
  Result result_;
};

TEST_F(EpisodeTest, NothingWorksBeforeTheFirstReset) {
  Sensors sensors;
  Scene scene;
  EXPECT_EQ(message_of<ResetNeeded>([&] { step(); }), "step: there is no episode yet; reset first");
  EXPECT_EQ(message_of<ResetNeeded>([&] { episode_->sense(sensors); }),
            "sense: there is no episode yet; reset first");
  EXPECT_EQ(message_of<ResetNeeded>([&] { episode_->scene(scene); }),
            "scene: there is no episode yet; reset first");
  EXPECT_EQ(fake_->steps + fake_->senses, 0);
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
  step();
  step();
  fake_->terminates = true;
  step();
  EXPECT_TRUE(result_.truncated);
  EXPECT_TRUE(result_.terminated);
  EXPECT_STREQ(result_.end_reason, "fell");
}

TEST_F(EpisodeTest, ZeroIsNoLimit) {
  limit_to(0);
  reset();
  for (int i = 0; i < 10000; ++i) {
    step();
    ASSERT_FALSE(result_.truncated);
  }
}

TEST_F(EpisodeTest, NoStepAfterTheEnd) {
  reset();
  step();
  fake_->terminates = true;
  step();
  EXPECT_EQ(message_of<ResetNeeded>([&] { step(); }),
            "step: the episode ended after 2 steps; reset first");
  EXPECT_EQ(fake_->steps, 2);
  Sensors sensors;
  EXPECT_NO_THROW(episode_->sense(sensors)) << "the last state can still be measured";
  fake_->terminates = false;
  reset();
  EXPECT_NO_THROW(step());
}

TEST_F(EpisodeTest, NoStepAfterAResetThatFailed) {
  reset();
  fake_->reset_fails = true;
  EXPECT_THROW(reset(), std::runtime_error);
  Sensors sensors;
  EXPECT_EQ(message_of<ResetNeeded>([&] { step(); }), "step: the simulation failed; reset first");
  EXPECT_EQ(message_of<ResetNeeded>([&] { episode_->sense(sensors); }),
            "sense: the simulation failed; reset first");
  EXPECT_EQ(fake_->steps, 0);
}

TEST_F(EpisodeTest, AnEngineThatFailsEndsTheEpisodeInItsOwnWords) {
  reset();
  fake_->step_fails = true;
  step();
  EXPECT_TRUE(result_.terminated);
  EXPECT_FALSE(result_.truncated);
  EXPECT_STREQ(result_.end_reason, "the simulation failed");
  EXPECT_STREQ(result_.error, "the engine gave up");
  EXPECT_EQ(result_.reward, 0);
  EXPECT_EQ(observation_, 3) << "as it was";
  EXPECT_TRUE(std::isnan(info_[0]) && std::isnan(info_[1])) << "absent";
  Sensors sensors;
  EXPECT_EQ(message_of<ResetNeeded>([&] { step(); }), "step: the simulation failed; reset first");
  EXPECT_EQ(message_of<ResetNeeded>([&] { episode_->sense(sensors); }),
            "sense: the simulation failed; reset first");
  EXPECT_EQ(fake_->steps, 1);
  fake_->step_fails = false;
  reset();
  step();
  EXPECT_FALSE(result_.terminated);
}

TEST_F(EpisodeTest, MalformedActionsNeverReachTheEnvironment) {
  reset();
  EXPECT_EQ(refused_action({}), "action has 0 values; must have 2, one per joint");
  EXPECT_EQ(refused_action({0}), "action has 1 values; must have 2, one per joint");
  EXPECT_EQ(refused_action({0, 0, 0}), "action has 3 values; must have 2, one per joint");
  EXPECT_EQ(refused_action({0, kNan}), "action[1] (knee) = nan; must be finite");
  EXPECT_EQ(refused_action({0, -kInfinity}), "action[1] (knee) = -inf; must be finite");
  EXPECT_EQ(refused_action({kInfinity, 0}), "action[0] () = inf; must be finite");
  EXPECT_EQ(fake_->steps, 0);
  step();
  step();
  EXPECT_FALSE(result_.truncated) << "refused steps do not count";
}

TEST_F(EpisodeTest, TheNextResetContinuesFromAGivenGeneratorState) {
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
