#include "robots/bipedal_walker/world_settings.h"

#include <algorithm>
#include <initializer_list>
#include <limits>
#include <stdexcept>
#include <string>
#include <tuple>

#include "base/range_finder.h"
#include "base/shortest_text.h"

namespace walker::bipedal_walker {
namespace {

static_assert(kInitialPush / kStepsPerSecond * kStepsPerSecond == kInitialPush,
              "initial_push = 0.1 must be Gymnasium's draw");

// Sizes of obstacles of which a world names others: Gymnasium's smallest.
constexpr Stumps kStumps{kTerrainStep, kTerrainStep, 0};
constexpr Stairs kStairs{4 * kTerrainStep, kTerrainStep, 3};

/// Between the start pad and the far end [m].
constexpr double kCourse = (kTerrainLength - kTerrainGrass - kTerrainStartPad) * kTerrainStep;

auto numbers_of(const Stumps& stumps) {
  return std::tie(stumps.width, stumps.height, stumps.clearance);
}

auto numbers_of(const Stairs& stairs) {
  return std::tie(stairs.tread_width, stairs.rise, stairs.num_treads);
}

auto numbers_of(const Dynamics& dynamics) {
  return std::tie(dynamics.gravity, dynamics.friction_scale, dynamics.motor_strength,
                  dynamics.mass_scale, dynamics.joint_damping, dynamics.hip_speed,
                  dynamics.knee_speed);
}

template <typename Obstacles>
bool are_equal(const std::optional<Obstacles>& a, const std::optional<Obstacles>& b) {
  return a ? b && numbers_of(*a) == numbers_of(*b) : !b;
}

template <typename Values>
bool has_any(const Values& values, std::initializer_list<const char*> names) {
  return std::any_of(names.begin(), names.end(),
                     [&](const char* name) { return values.count(name) != 0; });
}

template <typename Values>
bool has_stumps(const Values& values) {
  return has_any(values, {"stump_width", "stump_height", "stump_float"});
}

template <typename Values>
bool has_stairs(const Values& values) {
  return has_any(values, {"stair_width", "stair_height", "stair_steps"});
}

Level level_of(const WorldValues& values) {
  Level level;
  level.ground_roughness = value_or(values, "ground_roughness", level.ground_roughness);
  const auto optional = [&](const char* name) {
    const auto found = values.find(name);
    return found == values.end() ? std::nullopt : std::optional<double>(found->second);
  };
  level.obstacle_spacing = optional("obstacle_spacing");
  level.pit_gap = optional("pit_gap");
  if (has_stumps(values)) {
    level.stumps = {value_or(values, "stump_width", kStumps.width),
                    value_or(values, "stump_height", kStumps.height),
                    value_or(values, "stump_float", kStumps.clearance)};
  }
  if (has_stairs(values)) {
    level.stairs = {value_or(values, "stair_width", kStairs.tread_width),
                    value_or(values, "stair_height", kStairs.rise),
                    static_cast<int>(value_or(values, "stair_steps", kStairs.num_treads))};
  }
  return level;
}

double high_or(const World& world, const char* name, double absent) {
  const auto found = world.find(name);
  return found == world.end() ? absent : found->second.high;
}

}  // namespace

bool operator==(const WorldSettings& a, const WorldSettings& b) {
  return a.level.ground_roughness == b.level.ground_roughness &&
         a.level.obstacle_spacing == b.level.obstacle_spacing &&
         a.level.pit_gap == b.level.pit_gap && are_equal(a.level.stumps, b.level.stumps) &&
         are_equal(a.level.stairs, b.level.stairs) &&
         numbers_of(a.dynamics) == numbers_of(b.dynamics) && a.lidar_range == b.lidar_range &&
         a.initial_force == b.initial_force;
}

WorldSettings settings_of(const WorldValues& values) {
  WorldSettings settings;
  if (values.empty()) return settings;
  settings.level = level_of(values);
  Dynamics& dynamics = settings.dynamics;
  dynamics.gravity = value_or(values, "gravity", dynamics.gravity);
  dynamics.friction_scale = value_or(values, "friction_scale", dynamics.friction_scale);
  dynamics.motor_strength = value_or(values, "motor_strength", dynamics.motor_strength);
  dynamics.mass_scale = value_or(values, "mass_scale", dynamics.mass_scale);
  dynamics.joint_damping = value_or(values, "joint_damping", dynamics.joint_damping);
  dynamics.hip_speed = value_or(values, "hip_speed", dynamics.hip_speed);
  dynamics.knee_speed = value_or(values, "knee_speed", dynamics.knee_speed);
  settings.lidar_range = value_or(values, "lidar_range", settings.lidar_range);
  settings.initial_force =
      value_or(values, "initial_push", settings.initial_force / kStepsPerSecond) * kStepsPerSecond;
  return settings;
}

std::vector<WorldParameter> world_parameters(bool hardcore) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  const std::string kind = hardcore ? ", in place of hardcore's obstacles: " : ": ";
  const std::string pits = "Pits" + kind;
  const std::string stumps = "Stumps" + kind;
  const std::string stairs = "Stairs, up or down" + kind;
  return {
      {"ground_roughness", "", "Factor of the grass's slopes.", 1, 0, 10},
      {"pit_gap", "m", pits + "distance between the two walls.", kNone, 0, 10},
      {"stump_width", "m", stumps + "width, 14/30 m if only other sizes are named.", kNone, 0.05,
       10},
      {"stump_height", "m", stumps + "height, 14/30 m if only other sizes are named.", kNone, 0.05,
       3},
      {"stump_float", "m", stumps + "height above the ground, 0 if only other sizes are named.",
       kNone, 0, 3},
      {"stair_width", "m", stairs + "width of a step, 56/30 m if only other sizes are named.",
       kNone, 0.5, 10},
      {"stair_height", "m", stairs + "height of a step, 14/30 m if only other sizes are named.",
       kNone, 0.05, 3},
      {"stair_steps", "",
       stairs + "number of steps, the first level with the ground if they go up; 3 if only other "
                "sizes are named.",
       kNone, 1, 10, true},
      {"obstacle_spacing", "m",
       "Length of the grass between two obstacles, rounded to columns of 14/30 m, of which "
       "Gymnasium draws 5 to 9.",
       kNone, 0.5, 80},
      {"gravity", "m/s^2", "Upward acceleration in free fall.", double{kGravity}, -30, 0},
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
      lidar_range_parameter(kLidarRange),
      {"initial_push", "N s",
       "Largest horizontal impulse on the hull during the reset, which draws one of either "
       "direction.",
       kInitialPush / kStepsPerSecond, 0, 10},
      range_noise_parameter(),
  };
}

void check_world(const World& world, bool hardcore) {
  if (has_stairs(world)) {
    const double width = high_or(world, "stair_width", kStairs.tread_width);
    const double steps = high_or(world, "stair_steps", kStairs.num_treads);
    if (steps * width > kCourse) {
      throw std::invalid_argument(
          "stair_steps = " + shortest_text(steps) + " of stair_width = " + shortest_text(width) +
          " m: the stairs would be " + shortest_text(steps * width) + " m long; must be at most " +
          shortest_text(kCourse) + " m, the length of the course");
    }
  }
  // The damping's torque is constant over a step. At twice this limit joints begin to oscillate.
  const auto mass = world.find("mass_scale");
  const double lightest = mass == world.end() ? 1 : mass->second.low;
  const double damping = high_or(world, "joint_damping", 0);
  if (damping > lightest) {
    throw std::invalid_argument("joint_damping = " + shortest_text(damping) +
                                " N m s with mass_scale = " + shortest_text(lightest) +
                                "; must be at most 1 N m s times mass_scale");
  }
  const bool has_obstacles =
      hardcore || has_stumps(world) || has_stairs(world) || world.count("pit_gap") != 0;
  const auto spacing = world.find("obstacle_spacing");
  if (spacing != world.end() && !has_obstacles) {
    throw std::invalid_argument("obstacle_spacing = " + shortest_text(spacing->second.high) +
                                " m: has no effect without obstacles; name also sizes of pits, "
                                "stumps or stairs, or take BipedalWalkerHardcore-v3");
  }
}

}  // namespace walker::bipedal_walker
