// Each parameter of the environments: accepted values, error messages, effects.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

#include "error_message.h"
#include "stepper.h"

namespace walker::walker2d {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::size_t kX = 0;  // index in observations with positions
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
const char* const kIds[] = {"Walker2d-v4", "Walker2d-v5"};

using List = std::vector<double>;

std::string refusal(const std::string& id, const std::string& name, const ParameterValue& value) {
  return message_of<std::invalid_argument>([&] { make(id, {{name, value}}); });
}

Stepper fallen(const std::string& id, const Parameters& parameters) {
  Stepper walker(id, parameters);
  walker.reset(0);
  while (!walker.has_ended()) walker.step({0.5, 0.5, 0.5, 0, 0, 0});
  return walker;
}

Stepper stepped(const std::string& id, const Parameters& parameters) {
  Stepper walker(id, parameters);
  walker.reset(0);
  walker.step({0.5, 0.5, 0.5, 0, 0, 0});
  return walker;
}

TEST(Walker2dParameters, AreGymnasiumsWithItsDefaults) {
  const std::vector<std::pair<std::string, ParameterValue>> common{
      {"forward_reward_weight", 1.0},
      {"ctrl_cost_weight", 1e-3},
      {"healthy_reward", 1.0},
      {"terminate_when_unhealthy", true},
      {"healthy_z_range", List{0.8, 2.0}},
      {"healthy_angle_range", List{-1.0, 1.0}},
      {"reset_noise_scale", 5e-3},
      {"exclude_current_positions_from_observation", true},
      {"max_episode_steps", std::int64_t{1000}}};
  std::vector<std::pair<std::string, ParameterValue>> v5{
      {"xml_file", std::string("walker2d_v5.xml")}, {"frame_skip", std::int64_t{4}}};
  v5.insert(v5.end(), common.begin(), common.end());
  EXPECT_EQ(make("Walker2d-v4")->specification().parameters, common);
  EXPECT_EQ(make("Walker2d-v5")->specification().parameters, v5);
}

TEST(Walker2dParameters, AreToldAsGiven) {
  const std::vector<std::pair<std::string, ParameterValue>> given{
      {"xml_file", std::string("walker2d_v4.xml")},
      {"frame_skip", std::int64_t{3}},
      {"forward_reward_weight", 2.0},
      {"ctrl_cost_weight", 0.1},
      {"healthy_reward", -1.0},
      {"terminate_when_unhealthy", false},
      {"healthy_z_range", List{0.5, kInfinity}},
      {"healthy_angle_range", List{-0.5, 0.25}},
      {"reset_noise_scale", 0.1},
      {"exclude_current_positions_from_observation", false},
      {"max_episode_steps", std::int64_t{7}}};
  EXPECT_EQ(make("Walker2d-v5", Parameters(given.begin(), given.end()))->specification().parameters,
            given);
}

TEST(Walker2dParameters, OutOfRangeAreRefusedWithTheRange) {
  for (const char* id : kIds) {
    for (const char* name : {"forward_reward_weight", "ctrl_cost_weight", "healthy_reward"}) {
      for (const auto& [value, text] :
           {std::pair(2e9, "2000000000.0"), std::pair(-2e9, "-2000000000.0"),
            std::pair(kInfinity, ".inf"), std::pair(kNan, ".nan")}) {
        EXPECT_EQ(refusal(id, name, value),
                  "parameter " + std::string(name) + " = " + text +
                      ": must be a number in [-1000000000.0, 1000000000.0]");
      }
    }
    EXPECT_EQ(refusal(id, "reset_noise_scale", -1e-9),
              "parameter reset_noise_scale = -1.0e-09: must be a number in [0.0, 1000000.0]");
    EXPECT_NE(refusal(id, "reset_noise_scale", 1.1e6), "nothing thrown");
    EXPECT_NE(refusal(id, "reset_noise_scale", kNan), "nothing thrown");
    EXPECT_NE(refusal(id, "max_episode_steps", std::int64_t{-1}), "nothing thrown");
  }
  EXPECT_EQ(refusal("Walker2d-v5", "frame_skip", std::int64_t{0}),
            "parameter frame_skip = 0: must be an integer in [1, 1000]");
  EXPECT_NE(refusal("Walker2d-v5", "frame_skip", std::int64_t{1001}), "nothing thrown");
  EXPECT_NE(refusal("Walker2d-v5", "frame_skip", std::int64_t{-4}), "nothing thrown");
  EXPECT_NE(refusal("Walker2d-v5", "frame_skip", 2.5), "nothing thrown");
  EXPECT_EQ(refusal("Walker2d-v5", "frame_skip", 2.0), "nothing thrown");
}

TEST(Walker2dParameters, OfAWrongTypeAreRefusedWithTheType) {
  for (const char* id : kIds) {
    EXPECT_EQ(refusal(id, "terminate_when_unhealthy", 1.0),
              "parameter terminate_when_unhealthy = 1.0: must be true or false");
    EXPECT_EQ(refusal(id, "exclude_current_positions_from_observation", std::string("no")),
              "parameter exclude_current_positions_from_observation = no: must be true or false");
    EXPECT_EQ(refusal(id, "healthy_reward", std::string("much")),
              "parameter healthy_reward = much: must be a number");
    EXPECT_EQ(refusal(id, "healthy_reward", true),
              "parameter healthy_reward = true: must be a number");
    EXPECT_EQ(refusal(id, "healthy_z_range", 0.8),
              "parameter healthy_z_range = 0.8: must be a list of numbers");
  }
  EXPECT_EQ(refusal("Walker2d-v5", "xml_file", 5.0), "parameter xml_file = 5.0: must be a text");
  EXPECT_EQ(refusal("Walker2d-v5", "frame_skip", std::string("4")),
            "parameter frame_skip = 4: must be an integer");
}

TEST(Walker2dParameters, AnIntervalIsALowerNumberThenAHigherOne) {
  const std::pair<List, std::string> wrong[] = {
      {{2, 0.8}, "[2.0, 0.8]: must be a lower number, then a higher one"},
      {{1, 1}, "[1.0, 1.0]: must be a lower number, then a higher one"},
      {{kInfinity, -kInfinity}, "[.inf, -.inf]: must be a lower number, then a higher one"},
      {{}, "[]: must be a list of 2 numbers"},
      {{1}, "[1.0]: must be a list of 2 numbers"},
      {{1, 2, 3}, "[1.0, 2.0, 3.0]: must be a list of 2 numbers"},
      {{kNan, 1}, "[.nan, 1.0]: must be a list of numbers in [-.inf, .inf]"},
      {{0, kNan}, "[0.0, .nan]: must be a list of numbers in [-.inf, .inf]"}};
  for (const char* id : kIds) {
    for (const char* name : {"healthy_z_range", "healthy_angle_range"}) {
      for (const auto& [list, words] : wrong) {
        EXPECT_EQ(refusal(id, name, list), std::string("parameter ").append(name) + " = " + words);
      }
      EXPECT_EQ(refusal(id, name, List{-kInfinity, kInfinity}), "nothing thrown");
    }
  }
}

TEST(Walker2dParameters, UnknownOnesAreRefusedWithTheNearest) {
  const std::string message = refusal("Walker2d-v5", "healty_z_range", List{0, 1});
  EXPECT_NE(message.find("healty_z_range"), std::string::npos) << message;
  EXPECT_NE(message.find("healthy_z_range"), std::string::npos) << message;
  EXPECT_NE(refusal("Walker2d-v5", "hardcore", true), "nothing thrown");
}

/// Gymnasium's v4 also has a fixed model and frame skip.
TEST(Walker2dParameters, V4HasNoModelFileAndNoFrameSkip) {
  for (const char* name : {"xml_file", "frame_skip"}) {
    const std::string message = refusal("Walker2d-v4", name, std::int64_t{4});
    EXPECT_NE(message.find(name), std::string::npos) << message;
    EXPECT_NE(message.find("unknown"), std::string::npos) << message;
    const auto walker = make("Walker2d-v4");
    for (const auto& [known, value] : walker->specification().parameters) EXPECT_NE(known, name);
  }
}

// ---------------------------------------------------------------- effects

TEST(Walker2dParameters, WeightsScaleTheReward) {
  const Stepper plain = stepped("Walker2d-v5", {});
  const double forward = plain.info[3];
  ASSERT_NE(forward, 0);
  EXPECT_EQ(stepped("Walker2d-v5", {{"forward_reward_weight", 4.0}}).info[3], 4 * forward);
  EXPECT_EQ(stepped("Walker2d-v5", {{"ctrl_cost_weight", 0.5}}).info[4], -0.375);
  EXPECT_EQ(stepped("Walker2d-v5", {{"healthy_reward", 3.0}}).info[5], 3);
  EXPECT_EQ(
      stepped("Walker2d-v4",
              {{"forward_reward_weight", 0.0}, {"ctrl_cost_weight", 0.5}, {"healthy_reward", 3.0}})
          .result.reward,
      3 - 0.375);
}

TEST(Walker2dParameters, HealthDecidesTheEnd) {
  for (const char* id : kIds) {
    EXPECT_FALSE(stepped(id, {}).result.terminated);
    EXPECT_TRUE(stepped(id, {{"healthy_z_range", List{1.4, 2}}}).result.terminated);
    EXPECT_TRUE(stepped(id, {{"healthy_z_range", List{0, 1.2}}}).result.terminated);
    EXPECT_TRUE(stepped(id, {{"healthy_angle_range", List{0.5, 1}}}).result.terminated);
    EXPECT_TRUE(stepped(id, {{"healthy_angle_range", List{-1, -0.5}}}).result.terminated);
    EXPECT_FALSE(
        stepped(id, {{"healthy_z_range", List{1.4, 2}}, {"terminate_when_unhealthy", false}})
            .result.terminated);
    const Stepper endless = fallen(id, {{"terminate_when_unhealthy", false}});
    EXPECT_TRUE(endless.result.truncated);
    EXPECT_TRUE(fallen(id, {}).result.terminated);
  }
  const Stepper unhealthy = stepped(
      "Walker2d-v5", {{"healthy_z_range", List{1.4, 2}}, {"terminate_when_unhealthy", false}});
  EXPECT_EQ(unhealthy.info[5], 0);
}

TEST(Walker2dParameters, TheTrunksXMayBeObserved) {
  for (const char* id : kIds) {
    const Stepper without_x = stepped(id, {});
    const Stepper with_x = stepped(id, {{"exclude_current_positions_from_observation", false}});
    EXPECT_EQ(without_x.observation.size(), 17U);
    ASSERT_EQ(with_x.observation.size(), 18U);
    EXPECT_EQ(with_x.observation[0], with_x.info[0]);
    EXPECT_EQ(List(with_x.observation.begin() + 1, with_x.observation.end()),
              without_x.observation);
  }
}

TEST(Walker2dParameters, EpisodesMayBeShort) {
  for (const char* id : kIds) {
    const Stepper walker =
        fallen(id, {{"max_episode_steps", std::int64_t{5}}, {"terminate_when_unhealthy", false}});
    EXPECT_TRUE(walker.result.truncated);
    EXPECT_STREQ(walker.result.end_reason, "5 steps");
    EXPECT_EQ(walker.environment->specification().max_episode_steps, 5U);
  }
}

/// Two steps of two engine steps equal one of four; the velocity is the mean over the whole step.
TEST(Walker2dParameters, FrameSkipIsTheLengthOfAStep) {
  Parameters parameters{{"exclude_current_positions_from_observation", false}};
  Stepper four("Walker2d-v5", parameters);
  parameters["frame_skip"] = std::int64_t{2};
  Stepper two("Walker2d-v5", parameters);
  EXPECT_EQ(four.environment->specification().dt, 0.008);
  EXPECT_EQ(two.environment->specification().dt, 0.004);
  four.reset(1);
  two.reset(1);
  const List action{1, -1, 0.5, 0, -0.5, 1};
  for (int i = 0; i < 5; ++i) {
    const double start = four.observation[kX];
    four.step(action);
    two.step(action);
    EXPECT_EQ(two.info[2], (two.observation[kX] - start) / 0.004);
    two.step(action);
    EXPECT_EQ(four.observation, two.observation);
    EXPECT_EQ(four.info[2], (four.observation[kX] - start) / 0.008);
  }
}

TEST(Walker2dParameters, TheModelIsTheNamedOne) {
  const Stepper v4 = fallen("Walker2d-v4", {});
  const Stepper v5 = fallen("Walker2d-v5", {});
  const Stepper v5_on_v4 = fallen("Walker2d-v5", {{"xml_file", std::string("walker2d_v4.xml")}});
  EXPECT_EQ(v5_on_v4.observation, v4.observation);
  EXPECT_NE(v5.observation, v4.observation) << "the right foot grips";
}

}  // namespace
}  // namespace walker::walker2d
