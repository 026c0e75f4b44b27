// Parameters of BipedalWalker's worlds: names, defaults, contradictions.
#include "robots/bipedal_walker/world_settings.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <string>

#include "base/link_parameters.h"
#include "error_message.h"
#include "robots/bipedal_walker/random_world.h"

namespace walker::bipedal_walker {
namespace {

TEST(WorldSettingsTest, RegistrationHasTheParameters) {
  std::set<std::string> expected{
      "ground_roughness", "pit_gap",         "stump_width",      "stump_height",
      "stump_float",      "stair_width",     "stair_height",     "stair_steps",
      "stair_steps_vary", "gravity",         "friction_scale",   "motor_strength",
      "mass_scale",       "joint_damping",   "hip_speed",        "knee_speed",
      "lidar_range",      "initial_push",    "obstacle_spacing", "range_noise",
      "floor_friction",   "hull_mass",       "upper_leg_1_mass", "lower_leg_1_mass",
      "upper_leg_2_mass", "lower_leg_2_mass"};
  for (const std::string link : kLinks) expected.insert({link + "_force_x", link + "_force_z"});
  for (const std::string id : {kPlain, kHardcore}) {
    const Registration& registration = find_registration(id);
    std::set<std::string> names;
    for (const WorldParameter& parameter : registration.world_parameters) {
      names.insert(parameter.name);
      EXPECT_LT(parameter.minimum, parameter.maximum) << parameter.name;
      EXPECT_EQ(parameter.description.back(), '.') << parameter.name;
      if (std::isnan(parameter.default_value)) continue;
      EXPECT_LE(parameter.minimum, parameter.default_value) << parameter.name;
      EXPECT_GE(parameter.maximum, parameter.default_value) << parameter.name;
    }
    EXPECT_EQ(names, expected) << id;
  }
}

TEST(WorldSettingsTest, PushImpulseChangesTheVelocityByHalfAMeterPerSecond) {
  double mass = 0;
  for (const Link& link : make_robot(kPlain)->specification().links) mass += link.mass;
  EXPECT_NEAR(find_registration(kPlain).push_impulse / mass, 0.5, 0.05);
}

/// Gymnasium's roughness has its bits: level_test.cpp.
TEST(WorldSettingsTest, DefaultsAreThoseOfTheWorldWithoutValues) {
  for (const char* id : {kPlain, kHardcore}) {
    WorldValues all;
    for (const WorldParameter& parameter : find_registration(id).world_parameters) {
      if (!std::isnan(parameter.default_value)) all[parameter.name] = parameter.default_value;
    }
    EXPECT_TRUE(settings_of(all) == WorldSettings{}) << id;
  }
}

TEST(WorldSettingsTest, OtherNamesAreIgnored) {
  EXPECT_TRUE(settings_of({{"push_interval", 2}, {"dropout", 0.5}}) == WorldSettings{});
}

TEST(WorldSettingsTest, AreEqualIfAllValuesAre) {
  EXPECT_TRUE(settings_of({}) == WorldSettings{});
  for (const WorldParameter& parameter : world_parameters(false)) {
    if (parameter.name == "range_noise" || is_force_name(parameter.name))
      continue;  // the episode's
    const WorldValues values{{parameter.name, parameter.maximum}};
    EXPECT_TRUE(settings_of(values) == settings_of(values)) << parameter.name;
    EXPECT_FALSE(settings_of(values) == WorldSettings{}) << parameter.name;
    const double other = parameter.is_whole ? parameter.minimum : parameter.maximum / 2;
    const WorldValues others{{parameter.name, other}};
    if (parameter.name == "gravity") continue;  // both are 0
    EXPECT_FALSE(settings_of(values) == settings_of(others)) << parameter.name;
  }
}

std::string refusal(const char* id, const World& world) {
  return message_of<std::invalid_argument>([&] { find_registration(id).check_world(world); });
}

constexpr const char* kNothing = "nothing thrown";

TEST(WorldSettingsTest, ContradictionsAreRefused) {
  EXPECT_EQ(refusal(kPlain, {{"stair_steps", {1, 10}}, {"stair_width", {2, 8}}}),
            "stair_steps = 10 of stair_width = 8 m: the stairs would be 80 m long; must be at most "
            "79.33333333333333 m, the length of the course");
  EXPECT_EQ(refusal(kPlain, {{"stair_steps", {1, 10}}, {"stair_width", {2, 7.9}}}), kNothing);
  EXPECT_EQ(refusal(kPlain, {{"joint_damping", {0, 0.8}}, {"mass_scale", {0.5, 2}}}),
            "joint_damping = 0.8 N m s with mass_scale = 0.5; must be at most 1 N m s times "
            "mass_scale");
  EXPECT_EQ(refusal(kPlain, {{"joint_damping", {0, 0.5}}, {"mass_scale", {0.5, 2}}}), kNothing);
  EXPECT_NE(refusal(kPlain, {{"joint_damping", {1.1, 1.1}}}), kNothing);
  const World spaced{{"obstacle_spacing", {2, 3}}};
  EXPECT_EQ(refusal(kPlain, spaced),
            "obstacle_spacing = 3 m: has no effect without obstacles; name also sizes of pits, "
            "stumps or stairs, or take BipedalWalkerHardcore-v3");
  EXPECT_EQ(refusal(kHardcore, spaced), kNothing);
  for (const char* kind : {"pit_gap", "stump_float", "stair_steps"}) {
    World with_obstacles = spaced;
    with_obstacles[kind] = {1, 1};
    EXPECT_EQ(refusal(kPlain, with_obstacles), kNothing) << kind;
  }
  EXPECT_EQ(refusal(kPlain, {}), kNothing);
}

}  // namespace
}  // namespace walker::bipedal_walker
