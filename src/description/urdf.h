// A robot description (URDF) made from an environment's specification.
#pragma once

#include <set>
#include <string>

#include "walker_sim/specification.h"

namespace walker {

struct UrdfFiles {
  std::string urdf;              ///< the XML text
  std::set<std::string> meshes;  ///< names of files in the package's assets
};

/// BipedalWalker-v3 -> bipedal_walker: an id without its version, in snake case.
std::string robot_name(const std::string& id);

/// Describes the specification's links and joints. Numbers have the specification's precision.
/// - Prisms are displayed by the link's COLLADA mesh, whose material keeps the link's colour on
///   faces that a viewer's light does not reach. A prism with a rectangular section collides as a
///   box, any other as the link's STL mesh. `place_links` gives its position along y.
/// - Solids keep their poses. URDF has no capsule: it becomes a cylinder between two spheres.
/// - If a child's frame differs from its joint's, the child is fixed on a massless link (see
///   `turned_links`), so that each link's frame is the engine's.
/// - A joint without limits becomes continuous. URDF requires a velocity limit: 10000 rad/s stands
///   for none.
/// @param name of the robot
/// @throws std::invalid_argument for a joint that is not connected to the trunk, or for a link
///         without shapes whose inertia the engine does not know completely
UrdfFiles make_urdf(const Specification& specification, const std::string& name);

}  // namespace walker
