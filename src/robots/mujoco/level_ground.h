// The ground that is drawn for a level, on which MuJoCo's walkers walk.
#pragma once

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

/// Returns a world's level; empty: none, the floor is flat.
std::optional<Level> level_of(const WorldValues& values);

/// Returns the world's parameters of levels.
std::vector<WorldParameter> level_parameters();

/// @throws std::invalid_argument as `walker::check_level`
void check_level(const World& world);

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
  /// The upper side of a stump.
  struct Top {
    double left;
    double right;
    double top;
  };

  void cut_last_obstacle();
  void make_lines();
  void add_obstacle(const Obstacle& obstacle, double height_behind, std::vector<Point>& line);
  void add(const Point& point, std::vector<Point>& line);

  Point origin_;
  Ground ground_;               // relative to the origin, as the following ones
  std::vector<Point> walkway_;  // the line without stumps, and with a level way across pits
  std::vector<Top> stumps_;
  GroundLine line_;
};

}  // namespace walker::mujoco
