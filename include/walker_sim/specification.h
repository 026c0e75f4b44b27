// What an environment is: spaces, time, joints, links, engine. Constant over its life.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "walker_sim/parameters.h"

namespace walker {

using Vector3 = std::array<double, 3>;     ///< x, y, z
using Quaternion = std::array<double, 4>;  ///< x, y, z, w
using Color = std::array<double, 4>;       ///< red, green, blue, alpha in [0, 1]

/// A frame in another one: REP 103 axes, x forward, y left, z up.
struct Pose {
  Vector3 position{};                    ///< [m]
  Quaternion orientation{{0, 0, 0, 1}};  ///< unit quaternion
};

/// A convex polygon in the x,z plane of its link, swept along y.
struct Prism {
  std::vector<std::array<double, 2>> vertices;  ///< x, z [m], counter-clockwise seen from -y
};

/// A rigid body. Its frame sits at the joint that carries it (the trunk's: at the body's origin).
struct Link {
  std::string name;
  double mass = 0;           ///< [kg]
  Vector3 center_of_mass{};  ///< in the link's frame [m]
  double inertia = 0;        ///< about the y axis through the centre of mass [kg m^2]
  std::vector<Prism> shapes;
  Color color{};
};

/// A hinge between two links, with the actuator that drives it.
struct Joint {
  std::string name;
  std::string parent;       ///< link
  std::string child;        ///< link; its frame equals the joint's at every angle
  Vector3 origin;           ///< of the child's frame in the parent's [m]; no rotation at angle 0
  Vector3 axis;             ///< unit vector in the parent's frame
  double lower;             ///< [rad]
  double upper;             ///< [rad]
  double maximum_effort;    ///< actuator's limit [N m]
  double maximum_velocity;  ///< actuator's limit [rad/s]
};

/// A planar range finder whose rays keep their direction in the gravity-aligned `lidar` frame
/// (odom rolled by +pi/2: X forward, Y up), origin at the trunk's.
struct RangeFinder {
  std::size_t num_rays = 0;    ///< 0: the environment has none
  double angle_minimum = 0;    ///< of the first ray, about the frame's Z [rad]
  double angle_increment = 0;  ///< [rad]
  double maximum_range = 0;    ///< [m]
};

/// Everything about an environment that does not change while it lives.
struct Specification {
  std::string id;  ///< Gymnasium's, e.g. BipedalWalker-v3
  std::vector<std::pair<std::string, ParameterValue>> parameters;  ///< complete
  std::string observation_dtype;                                   ///< "float32" or "float64"
  std::vector<double> observation_low;
  std::vector<double> observation_high;
  std::vector<double> action_low;
  std::vector<double> action_high;
  std::vector<double> effort_per_action;  ///< joint effort that an action of 1 asks for [N m]
  double dt = 0;                          ///< simulation time of one step [s]
  std::uint32_t max_episode_steps = 0;    ///< 0: no limit
  double reward_threshold = 0;            ///< NaN: none
  std::vector<std::string> info_names;
  std::vector<Joint> joints;  ///< in action order
  std::vector<Link> links;    ///< the trunk first, then each joint's child in action order
  std::vector<std::string> contact_links;  ///< links with a ground contact sensor
  RangeFinder range_finder;
  std::string engine;
  std::string engine_version;
  std::string engine_path;  ///< file from which the engine's code was loaded

  std::size_t observation_size() const { return observation_low.size(); }
  std::size_t action_size() const { return action_low.size(); }
};

}  // namespace walker
