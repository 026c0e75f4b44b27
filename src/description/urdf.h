// A robot description made from what the environment tells of itself.
#pragma once

#include <set>
#include <string>

#include "walker_sim/specification.h"

namespace walker {

/// A robot description, and what it refers to.
struct UrdfFiles {
  std::string urdf;              ///< the XML text
  std::set<std::string> meshes;  ///< names of files in the package's assets
};

/// BipedalWalker-v3 -> bipedal_walker: an id without its version, in snake case.
std::string robot_name(const std::string& id);

/// Describes the specification's links and joints; numbers have the specification's precision.
/// - Prisms are seen as the link's COLLADA mesh, whose material keeps the faces in the link's
/// colour
///   that a viewer's light does not reach. One collides as a box where its section is a rectangle,
///   else as the link's STL mesh. `place_links` says where it stands in y. Solids stand where they
///   are; URDF knows no capsule, so one becomes a cylinder between two spheres.
/// - A child whose frame is not its joint's hangs on a link without mass (see `turned_links`) by a
///   fixed joint: so each link's frame is the engine's.
/// - A joint without limits becomes a continuous one. URDF demands a velocity limit; where there is
///   none it is 10000 rad/s.
/// @param name of the robot
/// @throws std::invalid_argument for a joint that does not hang on the trunk, or for a link without
///         shapes of which the engine does not know the whole inertia
UrdfFiles make_urdf(const Specification& specification, const std::string& name);

}  // namespace walker
