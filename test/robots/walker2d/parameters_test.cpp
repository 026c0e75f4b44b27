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

TEST(Walker2dParameters, AreInTheSpecification) {
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
      {"include_lidar_in_observation", true},
      {"max_episode_steps", std::int64_t{7}}};
  EXPECT_EQ(make("Walker2d-v5", Parameters(given.begin(), given.end()))->specification().parameters,
            given);
}

TEST(Walker2dParameters, RejectsValuesOutOfRange) {
  const std::string weight = ": must be a number in [-1000000000.0, 1000000000.0]";
  const std::string noise = ": must be a number in [0.0, 1000000.0]";
  const std::string frames = ": must be an integer in [1, 1000]";
  const std::string order = ": must be a lower number, then a higher one";
  const struct {
    const char* name;
    ParameterValue value;
    std::string message;
  } cases[] = {
      {"forward_reward_weight", 2e9, weight},
      {"forward_reward_weight", -2e9, weight},
      {"ctrl_cost_weight", kInfinity, weight},
      {"ctrl_cost_weight", -2e9, weight},
      {"healthy_reward", 2e9, weight},
      {"healthy_reward", kNan, weight},
      {"reset_noise_scale", -1e-9, noise},
      {"reset_noise_scale", 1.1e6, noise},
      {"frame_skip", std::int64_t{0}, frames},
      {"frame_skip", std::int64_t{1001}, frames},
      {"max_episode_steps", std::int64_t{-1}, ": must be an integer in [0, 4294967295]"},
      {"healthy_z_range", List{2, 0.8}, order},
      {"healthy_z_range", List{1, 1}, order},
      {"healthy_angle_range", List{kInfinity, -kInfinity}, order},
      {"healthy_angle_range", List{kNan, 1}, ": must be a list of numbers in [-.inf, .inf]"},
  };
  for (const char* id : kIds) {
    for (const auto& [name, value, message] : cases) {
      if (id == kIds[0] && std::string(name) == "frame_skip") continue;  // v4 has none
      EXPECT_EQ(refusal(id, name, value),
                "parameter " + std::string(name) + " = " + to_string(value) + message);
    }
    for (const char* name : {"healthy_z_range", "healthy_angle_range"}) {
      EXPECT_EQ(refusal(id, name, List{-kInfinity, kInfinity}), "nothing thrown");
    }
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

TEST(Walker2dParameters, HealthDecidesTermination) {
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

TEST(Walker2dParameters, TheTrunksXCanBeObserved) {
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

/// Two steps of two engine steps equal one of four; the velocity is the mean over the whole step.
TEST(Walker2dParameters, FrameSkipScalesTheStep) {
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
