// What Hopper adds to the MuJoCo robots: its model, parameters and healthy ranges.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "error_message.h"
#include "stepper.h"

namespace walker::hopper {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::size_t kSize = 3;

using List = std::vector<double>;

TEST(Hopper, IsGymnasiums) {
  for (const char* id : {"Hopper-v4", "Hopper-v5"}) {
    const auto hopper = make(id);
    const Specification& specification = hopper->specification();
    EXPECT_EQ(specification.id, id);
    EXPECT_EQ(specification.dt, 0.008);
    EXPECT_EQ(specification.max_episode_steps, 1000U);
    EXPECT_EQ(specification.reward_threshold, 3800);
    EXPECT_EQ(specification.observation_low, List(11, -kInfinity));
    EXPECT_EQ(specification.observation_high, List(11, kInfinity));
    EXPECT_EQ(specification.action_low, List(kSize, -1));
    EXPECT_EQ(specification.action_high, List(kSize, 1));
    EXPECT_EQ(specification.effort_per_action, List(kSize, 200));
    EXPECT_EQ(specification.contact_links, std::vector<std::string>{"foot"});
    ASSERT_EQ(specification.joints.size(), kSize);
    const std::vector<std::string> links{"torso", "thigh", "leg", "foot"};
    for (std::size_t i = 0; i < kSize; ++i) {
      EXPECT_EQ(specification.joints[i].name, links[i + 1] + "_joint");
      EXPECT_EQ(specification.joints[i].parent, links[i]);
      EXPECT_EQ(specification.joints[i].child, links[i + 1]);
    }
  }
}

TEST(Hopper, HasGymnasiumsParametersAndDefaults) {
  const std::vector<std::pair<std::string, ParameterValue>> common{
      {"forward_reward_weight", 1.0},
      {"ctrl_cost_weight", 1e-3},
      {"healthy_reward", 1.0},
      {"terminate_when_unhealthy", true},
      {"healthy_state_range", List{-100, 100}},
      {"healthy_z_range", List{0.7, kInfinity}},
      {"healthy_angle_range", List{-0.2, 0.2}},
      {"reset_noise_scale", 5e-3},
      {"exclude_current_positions_from_observation", true},
      {"max_episode_steps", std::int64_t{1000}}};
  std::vector<std::pair<std::string, ParameterValue>> v5{{"xml_file", std::string("hopper_v5.xml")},
                                                         {"frame_skip", std::int64_t{4}}};
  v5.insert(v5.end(), common.begin(), common.end());
  EXPECT_EQ(make("Hopper-v4")->specification().parameters, common);
  EXPECT_EQ(make("Hopper-v5")->specification().parameters, v5);
}

TEST(Hopper, RefusesAWalkersModel) {
  EXPECT_EQ(message_of<std::invalid_argument>([] {
              make("Hopper-v5", {{"xml_file", std::string("walker2d_v5.xml")}});
            }),
            "parameter xml_file = walker2d_v5.xml: nq = 9, nv = 9, nu = 6, na = 0; must be nq = nv "
            "= 6, nu = 3, na = 0, as in hopper_v5.xml");
  // Walker2d also rejects Hopper's model, even if it is already compiled.
  const auto hopper = make("Hopper-v5");
  EXPECT_THROW(make("Walker2d-v5", {{"xml_file", std::string("hopper_v5.xml")}}),
               std::invalid_argument);
}

std::string end_of(const Parameters& parameters) {
  Stepper hopper("Hopper-v5", parameters);
  hopper.reset(0);
  while (!hopper.has_ended()) hopper.step({1, 1, 1});
  return hopper.result.end_reason;
}

TEST(Hopper, EndsForWhatItsRangesSay) {
  const Parameters wide{{"healthy_state_range", List{-1e9, 1e9}},
                        {"healthy_z_range", List{-1e9, 1e9}},
                        {"healthy_angle_range", List{-1e9, 1e9}}};
  const auto with = [&wide](const char* name, double low, double high) {
    Parameters parameters = wide;
    parameters[name] = List{low, high};
    return parameters;
  };
  EXPECT_EQ(end_of(wide), "1000 steps");
  EXPECT_EQ(end_of(with("healthy_state_range", -2, 2)),
            "a number of the state left healthy_state_range");
  EXPECT_EQ(end_of(with("healthy_z_range", 0.7, kInfinity)),
            "the torso's height left healthy_z_range");
  EXPECT_EQ(end_of(with("healthy_angle_range", -0.2, 0.2)),
            "the torso's angle left healthy_angle_range");
}

/// The range does not apply to x and z.
TEST(Hopper, StateRangeBeginsAtTheTorsosAngle) {
  Stepper hopper("Hopper-v5", {{"healthy_state_range", List{-1.0, 1.0}}});
  hopper.reset(0);
  hopper.step({0, 0, 0});
  EXPECT_GT(hopper.info[0] + 1.25, 1) << "the torso's height, above the range";
  EXPECT_FALSE(hopper.has_ended());
}

}  // namespace
}  // namespace walker::hopper
