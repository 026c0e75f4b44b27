// A level as boxes for MuJoCo's world body.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "base/random.h"
#include "robots/level.h"
#include "walker_sim/sensors.h"
#include "walker_sim/world.h"

namespace walker::mujoco {

/// Gymnasium's BipedalWalker, whose legs are 2.2 times as long, has columns of 14/30 m.
constexpr double kColumn = 0.2;  // [m]

constexpr GroundSize kGroundSize{500, kColumn, 0, {kColumn, kColumn, 0}, {4 * kColumn, kColumn, 3}};

/// Boxes up to this distance from the trunk are in the model; farther ones the lidar cannot see.
constexpr double kSensing = 3.2;  // [m]

/// Returns a world's level; empty: none, the floor is flat.
std::optional<Level> level_of(const WorldValues& values);

/// Returns the world's parameters of levels.
std::vector<WorldParameter> level_parameters();

/// @throws std::invalid_argument as `walker::check_level`, or if the lidar sees farther than
///         `kSensing` in a level
void check_level(const World& world);

/// A box that is turned about y. Its width along y is the robot's matter.
struct GroundBox {
  std::array<double, 2> center;     ///< x, z [m]
  std::array<double, 2> half_size;  ///< along its own axes [m]
  std::array<double, 2> direction;  ///< of its own x axis: x, z
  double left;                      ///< smallest x [m]
  double right;                     ///< largest x [m]
  double top;                       ///< largest z [m]

  /// How far a contact's normal may lean from the top's normal, to the left and to the right, as
  /// the sine of the angle. At a ridge it may lean as far as the next box's normal. If the next box
  /// is level with this one or rises from it, the sine is 0.
  std::array<double, 2> max_tilt{1, 1};
};

/// Heights below a point of the trunk [m].
struct GroundBelow {
  double ground = 0;  ///< where the walker walks: a slope, a tread, a pit's rims
  double top = 0;     ///< the ground, or the top of a stump on it or above it
};

/// Ground and obstacles. Coordinates are relative to the ground below the robot's first position,
/// where the ground's start pad has its middle. At both ends it continues level.
class BoxGround {
 public:
  BoxGround(Generator& generator, const Level& level);

  /// The boxes, in ascending order of `left`.
  const std::vector<GroundBox>& boxes() const { return boxes_; }

  GroundBelow below(double x) const;

  /// @param x, z place of the ground's origin in the world [m]
  void describe(double x, double z, Scene& scene) const;

 private:
  /// A stretch on which the walker walks.
  struct Surface {
    Point from;
    Point to;
  };

  /// Where a piece of the ground is: inside the treads of stairs or the wall of a pit, at the
  /// bottom of a pit, or neither.
  enum class Place { hidden, pit, open };

  void cut_last_obstacle();
  Place place_of(const Point& from, const Point& to) const;
  void add_ground();
  void add_obstacle(const Obstacle& obstacle);
  void find_internal_edges();
  void add_box(const Point& from, const Point& to, double thickness);

  Ground ground_;
  std::vector<GroundBox> boxes_;
  std::vector<Surface> surfaces_;  // in ascending order of their left ends
  std::vector<Surface> stumps_;    // their tops
};

}  // namespace walker::mujoco
