// What sensors on the walker measure, and what stands around it.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "walker_sim/specification.h"

namespace walker {

/// Measurements of one instant. `Environment::sense` sizes the vectors at its first call with a
/// given object and only writes into them afterwards.
struct Sensors {
  std::vector<double> joint_position;  ///< joints in action order [rad]
  std::vector<double> joint_velocity;  ///< [rad/s]
  std::vector<double> joint_effort;    ///< of the last step [N m]
  std::vector<Pose> link_poses;        ///< links in specification order, in the world [m]
  Vector3 linear_velocity{};           ///< of the trunk's origin, world axes [m/s]
  Vector3 angular_velocity{};          ///< of the trunk, world axes [rad/s]
  Vector3 linear_acceleration{};  ///< of the trunk's origin without gravity, mean over the last
                                  ///< step, world axes [m/s^2]
  Vector3 gravity{};              ///< world axes [m/s^2]
  std::vector<double> ranges;     ///< of the range finder [m]; +infinity: the ray met nothing
  std::vector<std::uint8_t> contacts;  ///< per contact link: 1 touches the ground
};

/// A convex polygon in the world's x,z plane.
struct ScenePolygon {
  std::vector<std::array<double, 2>> points;  ///< x, z [m]
  Color color;
};

/// A flag on a pole.
struct Flag {
  double x;       ///< foot of the pole [m]
  double z;       ///< foot of the pole [m]
  double height;  ///< of the pole [m]
  Color color;
};

/// Level ground without an end, laid out in square tiles of two colours in turn.
struct Floor {
  double z;                     ///< [m]
  double tile;                  ///< side of a tile, of which one begins at x = 0 [m]
  std::array<Color, 2> colors;  ///< the lighter first
};

/// What stands around the walker. Changes only at a reset.
struct Scene {
  std::vector<ScenePolygon> ground;  ///< pieces of the ground; the first two points are the surface
  std::vector<Color> surface_colors;  ///< of the ground pieces' surfaces
  std::optional<Floor> floor;
  std::vector<ScenePolygon> obstacles;
  std::vector<ScenePolygon> clouds;
  std::vector<Flag> flags;
};

}  // namespace walker
