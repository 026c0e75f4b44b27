// Each parameter of the environments: accepted values and error messages. recordings_test.cpp has
// their effects.
#include <gtest/gtest.h>

#include <limits>
#include <stdexcept>

#include "error_message.h"
#include "stepper.h"

namespace walker::walker2d {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
const char* const kIds[] = {"Walker2d-v4", "Walker2d-v5"};

using List = std::vector<double>;

std::string refusal(const std::string& id, const std::string& name, const ParameterValue& value) {
  return message_of<std::invalid_argument>([&] { make(id, {{name, value}}); });
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
  const auto walker = make("Walker2d-v5", Parameters(given.begin(), given.end()));
  EXPECT_EQ(walker->specification().parameters, given);
  EXPECT_EQ(walker->specification().dt, 0.002 * 3);
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

TEST(Walker2dParameters, TheModelIsTheNamedOne) {
  const auto fallen = [](const std::string& id, const Parameters& parameters = {}) {
    Stepper walker(id, parameters);
    walker.reset(0);
    while (!walker.has_ended()) walker.step({0.5, 0.5, 0.5, 0, 0, 0});
    return walker.observation;
  };
  const List v4 = fallen("Walker2d-v4");
  EXPECT_EQ(fallen("Walker2d-v5", {{"xml_file", std::string("walker2d_v4.xml")}}), v4);
  EXPECT_NE(fallen("Walker2d-v5"), v4) << "the right foot grips";
}

}  // namespace
}  // namespace walker::walker2d
