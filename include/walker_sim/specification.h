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

/// A round or rectangular solid.
struct Solid {
  enum class Kind { sphere, capsule, cylinder, box };

  Kind kind = Kind::sphere;
  Pose pose;       ///< in the link's frame; capsules and cylinders stand along its z
  Vector3 size{};  ///< box: half lengths along x, y, z; else the radius, then half the length
                   ///< (of a capsule without its caps) [m]
};

/// A symmetric tensor.
struct Inertia {
  double xx = 0;
  double yy = 0;
  double zz = 0;
  double xy = 0;
  double xz = 0;
  double yz = 0;
};

/// A rigid body.
struct Link {
  std::string name;
  double mass = 0;           ///< [kg]
  Vector3 center_of_mass{};  ///< in the link's frame [m]
  Inertia inertia;           ///< about the centre of mass, along the link's axes [kg m^2]; NaN: the
                             ///< engine is planar and knows yy alone
  std::vector<Prism> prisms;
  std::vector<Solid> solids;
  Color color{};
  std::string mesh;  ///< of the prisms, by files in the package's assets: `mesh`.dae to be seen,
                     ///< `mesh`.stl to collide with where no box does
};

/// A hinge between two links, with the actuator that drives it. Its frame turns with the child and
/// is parallel to the parent's at angle 0.
struct Joint {
  std::string name;
  std::string parent;       ///< link
  std::string child;        ///< link
  Vector3 origin;           ///< of the joint's frame in the parent's [m]
  Vector3 axis;             ///< unit vector in the parent's frame
  double lower;             ///< [rad]; -infinity: turns without end
  double upper;             ///< [rad]; +infinity: turns without end
  double maximum_effort;    ///< actuator's limit [N m]
  double maximum_velocity;  ///< actuator's limit [rad/s]; infinity: none
  Pose child_frame{};       ///< the child's frame in the joint's; BipedalWalker: the same frame
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
  Vector3 gravity{};                      ///< world axes [m/s^2]
  std::uint32_t max_episode_steps = 0;    ///< 0: no limit
  double reward_threshold = 0;            ///< NaN: none
  std::vector<std::string> info_names;
  std::vector<Joint> joints;      ///< in action order
  std::vector<Link> links;        ///< the trunk first, then each joint's child in action order
  bool joints_are_exact = false;  ///< the links' poses follow from the trunk's and the joints'
                                  ///< angles to double precision; else the engine's joints give,
                                  ///< and the numbers about its bodies have single precision
  bool episodes_are_independent = true;  ///< an episode depends on the generator's state before its
                                         ///< reset and on the actions alone
  std::vector<std::string> contact_links;  ///< links with a ground contact sensor
  RangeFinder range_finder;
  std::string engine;
  std::string engine_version;  ///< and, where there is a choice, by what it is stepped
  std::string engine_path;     ///< file from which the engine's code was loaded

  std::size_t observation_size() const { return observation_low.size(); }
  std::size_t action_size() const { return action_low.size(); }
};

}  // namespace walker
