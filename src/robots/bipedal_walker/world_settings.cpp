#include "robots/bipedal_walker/world_settings.h"

#include <stdexcept>
#include <string>
#include <tuple>

#include "base/link_parameters.h"
#include "base/range_finder.h"
#include "base/shortest_text.h"

namespace walker::bipedal_walker {
namespace {

static_assert(kInitialPush / kStepsPerSecond * kStepsPerSecond == kInitialPush,
              "initial_push = 0.1 must be Gymnasium's draw");

auto numbers_of(const Dynamics& dynamics) {
  return std::tie(dynamics.gravity, dynamics.floor_friction, dynamics.friction_scale,
                  dynamics.motor_strength, dynamics.mass_scale, dynamics.masses,
                  dynamics.joint_damping, dynamics.hip_speed, dynamics.knee_speed);
}

}  // namespace

bool operator==(const WorldSettings& a, const WorldSettings& b) {
  return a.level == b.level && numbers_of(a.dynamics) == numbers_of(b.dynamics) &&
         a.lidar_range == b.lidar_range && a.initial_force == b.initial_force;
}

WorldSettings settings_of(const WorldValues& values) {
  WorldSettings settings;
  if (values.empty()) return settings;
  settings.level = level_of(values, kGroundSize, settings.level.ground_roughness);
  Dynamics& dynamics = settings.dynamics;
  dynamics.gravity = value_or(values, "gravity", dynamics.gravity);
  dynamics.floor_friction = value_or(values, "floor_friction", dynamics.floor_friction);
  dynamics.friction_scale = value_or(values, "friction_scale", dynamics.friction_scale);
  dynamics.motor_strength = value_or(values, "motor_strength", dynamics.motor_strength);
  dynamics.mass_scale = value_or(values, "mass_scale", dynamics.mass_scale);
  for (std::size_t i = 0; i < kBodies; ++i) {
    dynamics.masses[i] = value_or(values, mass_name(kLinks[i]), 0);
  }
  dynamics.joint_damping = value_or(values, "joint_damping", dynamics.joint_damping);
  dynamics.hip_speed = value_or(values, "hip_speed", dynamics.hip_speed);
  dynamics.knee_speed = value_or(values, "knee_speed", dynamics.knee_speed);
  settings.lidar_range = value_or(values, "lidar_range", settings.lidar_range);
  settings.initial_force =
      value_or(values, "initial_push", settings.initial_force / kStepsPerSecond) * kStepsPerSecond;
  return settings;
}

std::vector<WorldParameter> world_parameters(bool hardcore) {
  const LevelLimits limits{1, 10, 10, {0.05, 10}, {0.05, 3}, 3, {0.5, 10}, {0.05, 3}, {0.5, 80}};
  const LevelTexts texts{
      "Factor of the grass's slopes.", hardcore ? ", in place of hardcore's obstacles" : "",
      "14/30 m", "56/30 m",
      "Length of the grass between two obstacles, rounded to columns of 14/30 m, of which "
      "Gymnasium draws 5 to 9; up to two columns longer."};
  std::vector<WorldParameter> parameters = level_parameters(limits, texts);
  std::vector<WorldParameter> physics{
      {"gravity", "m/s^2", "Upward acceleration in free fall.", double{kGravity}, -30, 0},
      {"floor_friction", "",
       "Friction of the ground, before friction_scale. A contact has the geometric mean of the "
       "ground's and the link's.",
       kTerrainFriction, 0, 10},
      {"friction_scale", "", "Factor of each contact's friction.", 1, 0, 10},
      {"motor_strength", "", "Factor of the motors' torque limits.", 1, 0, 5},
      {"mass_scale", "", "Factor of the masses and inertias of hull and legs.", 1, 0.2, 5},
      {"joint_damping", "N m s",
       "Torque against each joint's rotation per rad/s, at most 1 N m s times mass_scale.", 0, 0,
       5},
      {"hip_speed", "rad/s", "Speed of the hips' motors; observed speeds stay fractions of 4.",
       kHipSpeed, 0, 15},
      {"knee_speed", "rad/s", "Speed of the knees' motors; observed speeds stay fractions of 6.",
       kKneeSpeed, 0, 15},
      mass_parameter(kLinks[0], 1, 30),
  };
  for (std::size_t i = 1; i < kBodies; ++i) physics.push_back(mass_parameter(kLinks[i], 0.05, 3));
  add_force_parameters({kLinks.begin(), kLinks.end()}, kPushImpulse, physics);
  for (WorldParameter& parameter : physics) parameter.can_change = true;
  parameters.insert(parameters.end(), physics.begin(), physics.end());
  parameters.push_back(lidar_range_parameter(kLidarRange));
  parameters.push_back({"initial_push", "N s",
                        "Largest horizontal impulse on the hull during the reset, which draws one "
                        "of either direction.",
                        kInitialPush / kStepsPerSecond, 0, 10});
  parameters.push_back(range_noise_parameter());
  return parameters;
}

void check_world(const World& world, bool hardcore) {
  check_level(world, kGroundSize, hardcore, ", or take BipedalWalkerHardcore-v3");
  // The damping's torque is constant over a step. At twice this limit joints begin to oscillate.
  const double lightest = range_or(world, "mass_scale", 1).low;
  const double damping = range_or(world, "joint_damping", 0).high;
  if (damping > lightest) {
    throw std::invalid_argument("joint_damping = " + shortest_text(damping) +
                                " N m s with mass_scale = " + shortest_text(lightest) +
                                "; must be at most 1 N m s times mass_scale");
  }
}

}  // namespace walker::bipedal_walker
