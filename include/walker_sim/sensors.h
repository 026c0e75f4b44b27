// Sensor measurements and surroundings of a walker.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "walker_sim/specification.h"

namespace walker {

/// Sensor measurements at one instant. The first `Environment::sense` into an object sizes its
/// vectors; later calls reuse them.
struct Sensors {
  std::vector<double> joint_position;  ///< joints in action order [rad]
  std::vector<double> joint_velocity;  ///< [rad/s]
  std::vector<double> joint_effort;    ///< in the last step [N m]
  std::vector<Pose> link_poses;        ///< links in specification order, world frame
  Vector3 linear_velocity{};           ///< trunk's origin, world axes [m/s]
  Vector3 angular_velocity{};          ///< trunk, world axes [rad/s]
  Vector3 linear_acceleration{};  ///< trunk's origin, without gravity, mean over the last step,
                                  ///< world axes [m/s^2]
  Vector3 gravity{};              ///< world axes [m/s^2]
  std::vector<double> ranges;     ///< of the range finder [m]; +infinity: no hit
  double maximum_range = 0;       ///< of the range finder in this world [m]; 0: there is none
  std::vector<std::uint8_t> contacts;  ///< per contact link; 1: touches the ground
};

/// A convex polygon in the world's x,z plane.
struct ScenePolygon {
  std::vector<std::array<double, 2>> points;  ///< x, z [m]
  Color color;
};

struct Flag {
  double x;       ///< foot of the pole [m]
  double z;       ///< foot of the pole [m]
  double height;  ///< of the pole [m]
  Color color;
};

/// An infinite level ground with a checkerboard of two colours.
struct Floor {
  double z;                     ///< [m]
  double tile;                  ///< side of a tile [m]; x = 0 is an edge
  std::array<Color, 2> colors;  ///< the lighter first
};

/// The walker's surroundings. They change only at a reset.
struct Scene {
  std::vector<ScenePolygon> ground;   ///< the first two points of each are its surface
  std::vector<Color> surface_colors;  ///< per ground polygon
  std::optional<Floor> floor;
  std::vector<ScenePolygon> obstacles;
  std::vector<ScenePolygon> clouds;
  std::vector<Flag> flags;
};

/// A robot's sensor measurements at one instant, in the axes and units of the ROS messages that
/// carry them (REP 103, 117, 145). They suffice to compute a trained policy's observation.
struct Measurements {
  std::vector<double> joint_position;    ///< joints in action order [rad]
  std::vector<double> joint_velocity;    ///< [rad/s]
  Quaternion orientation{{0, 0, 0, 1}};  ///< trunk in the world frame; from imu
  Vector3 angular_velocity{};            ///< trunk, in its own axes [rad/s]; from imu
  Vector3 position{};                    ///< trunk's origin in the world frame [m]; from odom
  Vector3 linear_velocity{};  ///< trunk's origin, in the trunk's axes [m/s]; from odom's twist
  std::vector<std::uint8_t> contacts;  ///< per contact link; 1: touches the ground
  std::vector<double> ranges;          ///< of the range finder [m]; +infinity: no hit; unused
                                       ///< unless the observation contains them
  double maximum_range = 0;            ///< of the range finder [m]; from scan
};

}  // namespace walker
