// Specification of an environment: spaces, time step, joints, links, engine.
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

/// Pose of a frame in another one, with REP 103 axes: x forward, y left, z up.
struct Pose {
  Vector3 position{};                    ///< [m]
  Quaternion orientation{{0, 0, 0, 1}};  ///< unit quaternion
};

/// A convex polygon in the x,z plane of its link, swept along y.
struct Prism {
  std::vector<std::array<double, 2>> vertices;  ///< x, z [m], counter-clockwise seen from -y
};

struct Solid {
  enum class Kind { sphere, capsule, cylinder, box };

  Kind kind = Kind::sphere;
  Pose pose;       ///< in the link's frame; the axis of capsules and cylinders is z
  Vector3 size{};  ///< box: half lengths along x, y, z; else the radius, then half the length
                   ///< (of a capsule without its caps) [m]
};

struct Inertia {
  double xx = 0;
  double yy = 0;
  double zz = 0;
  double xy = 0;
  double xz = 0;
  double yz = 0;
};

struct Link {
  std::string name;
  double mass = 0;           ///< [kg]
  Vector3 center_of_mass{};  ///< in the link's frame [m]
  Inertia inertia;           ///< about the centre of mass, along the link's axes [kg m^2]; NaN
                             ///< except yy if the engine is planar
  std::vector<Prism> prisms;
  std::vector<Solid> solids;
  Color color{};
  std::string mesh;  ///< name of the prisms' mesh files in the package's assets: `mesh`.dae for
                     ///< display, `mesh`.stl for collisions unless a box is exact
};

/// A hinge between two links, and its actuator. The joint's frame rotates with the child and is
/// parallel to the parent's at angle 0.
struct Joint {
  std::string name;
  std::string parent;       ///< link
  std::string child;        ///< link
  Vector3 origin;           ///< of the joint's frame, in the parent's frame [m]
  Vector3 axis;             ///< unit vector in the parent's frame
  double lower;             ///< [rad]; -infinity: no limit
  double upper;             ///< [rad]; +infinity: no limit
  double maximum_effort;    ///< actuator's limit [N m]
  double maximum_velocity;  ///< actuator's limit [rad/s]; infinity: none
  Pose child_frame{};       ///< child's frame in the joint's frame; BipedalWalker: identity
};

/// A planar range finder. Its rays have fixed directions in the gravity-aligned `lidar` frame (odom
/// rolled by +pi/2: X forward, Y up), whose origin is the trunk's.
struct RangeFinder {
  std::size_t num_rays = 0;    ///< 0: the environment has none
  double angle_minimum = 0;    ///< of the first ray, about the frame's Z [rad]
  double angle_increment = 0;  ///< [rad]
  double maximum_range = 0;    ///< [m]
  bool is_observed = true;     ///< the observation contains the ranges
  bool is_optional = false;    ///< a parameter decides whether it does
};

/// The properties of an environment that are constant over its lifetime.
struct Specification {
  std::string id;  ///< Gymnasium's id, e.g. BipedalWalker-v3
  std::vector<std::pair<std::string, ParameterValue>> parameters;  ///< complete
  std::string observation_dtype;                                   ///< "float32" or "float64"
  std::vector<double> observation_low;
  std::vector<double> observation_high;
  std::vector<double> action_low;
  std::vector<double> action_high;
  std::vector<double> effort_per_action;  ///< joint effort commanded by an action of 1 [N m]
  double dt = 0;                          ///< simulation time of one step [s]
  Vector3 gravity{};                      ///< world axes [m/s^2]
  std::uint32_t max_episode_steps = 0;    ///< 0: no limit
  double reward_threshold = 0;            ///< NaN: none
  std::vector<std::string> info_names;
  std::vector<Joint> joints;      ///< in action order
  std::vector<Link> links;        ///< the trunk first, then each joint's child in action order
  bool joints_are_exact = false;  ///< the trunk's pose and the joint angles determine the link
                                  ///< poses to double precision; if false, the engine's joints are
                                  ///< compliant and its bodies have single precision
  bool episodes_are_independent = true;    ///< an episode depends only on the generator's state
                                           ///< before its reset and on the actions
  std::vector<std::string> contact_links;  ///< links with a ground contact sensor
  RangeFinder range_finder;
  std::size_t num_coordinates = 0;  ///< generalized positions, and as many velocities, that
                                    ///< `set_coordinates` takes; 0: it is refused
  /// World parameters of this id that the environment's other parameters rule out, and why.
  std::vector<std::pair<std::string, std::string>> inapplicable_world_parameters;
  std::string engine;
  std::string engine_version;  ///< release and origin, also libm variant and stepper if they vary
  std::string engine_path;     ///< file that the engine's code was loaded from

  std::size_t observation_size() const { return observation_low.size(); }
  std::size_t action_size() const { return action_low.size(); }
};

}  // namespace walker
