// The ground that is drawn for a level, on which MuJoCo's walkers walk.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "base/random.h"
#include "robots/level.h"
#include "robots/mujoco/ground_line.h"
#include "walker_sim/sensors.h"
#include "walker_sim/world.h"

namespace walker::mujoco {

/// Gymnasium's BipedalWalker, whose legs are 2.2 times as long, has columns of 14/30 m.
constexpr double kColumn = 0.2;  // [m]

constexpr GroundSize kGroundSize{500, kColumn, 0, {kColumn, kColumn, 0}, {4 * kColumn, kColumn, 3}};

/// Tiles of level ground.
constexpr double kTile = 0.5;  ///< length [m]
constexpr std::array<Color, 2> kTileColors{{{0.85, 0.89, 0.87, 1}, {0.55, 0.65, 0.66, 1}}};

/// Returns a world's level; empty: none, the floor is flat.
std::optional<Level> level_of(const WorldValues& values);

/// Returns the world's parameters of levels.
std::vector<WorldParameter> level_parameters();

/// Heights below a point of the trunk [m].
struct GroundBelow {
  double ground = 0;  ///< where the walker walks: a slope, a tread, a pit's rims
  double top = 0;     ///< the ground, or the top of a stump on it or above it
};

/// Ground and obstacles. The ground below the robot's first position, where the start pad has its
/// middle, is at the origin; both ends continue level.
class LevelGround {
 public:
  /// @param origin in the world [m]
  LevelGround(Generator& generator, const Level& level, const Point& origin);

  /// What limbs and rays touch, in the world.
  const GroundLine& line() const { return line_; }

  /// @param x distance from the origin [m]
  GroundBelow below(double x) const;

  void describe(Scene& scene) const;

 private:
  double top_of(const Obstacle& stump) const { return ground_.obstacles[stump.first_box][2].y; }
  GroundLine join();
  void add_outline(const Obstacle& obstacle);

  Point origin_;
  Ground ground_;               // relative to the origin
  std::vector<Point> surface_;  // `line_` relative to the origin, without what hangs above it
  GroundLine line_;
};

}  // namespace walker::mujoco
