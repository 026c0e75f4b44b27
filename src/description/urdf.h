// A robot description made from what the environment tells of itself.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "walker_sim/specification.h"

namespace walker {

/// How far bodies of a planar world reach in y, for the eye and for whoever collides with them.
/// Masses stay in the plane y = 0.
struct UrdfDepths {
  double trunk = 0.4;  ///< [m]
  double limb = 0.16;  ///< [m]
  double gap = 0.02;   ///< between neighbours in y [m]
};

/// Where a link's prisms stand in y and how far they reach [m].
struct Place {
  double y = 0;
  double depth = 0;
};

/// The places of a planar world's links by name: branches of the trunk stand beside each other in
/// y, the first on the far side (+y).
/// @throws std::invalid_argument for a joint that does not hang on the trunk
std::map<std::string, Place> place_links(const Specification& specification,
                                         const UrdfDepths& depths = {});

/// The files of a robot description.
struct UrdfFiles {
  std::string urdf;                           ///< the XML text
  std::map<std::string, std::string> meshes;  ///< content of binary STL files by file name
};

/// BipedalWalkerHardcore-v3 -> bipedal_walker_hardcore: an id without its version, in snake case.
std::string robot_name(const std::string& id);

/// What each joint turns, by name: its child, or, where the child's frame is not the joint's, the
/// link without mass on which the child is fixed, `<child>_hinge`; longer where that name is taken.
std::vector<std::string> turned_links(const Specification& specification);

/// Describes the specification's links and joints; numbers have the specification's precision.
/// - A prism is seen as a COLLADA mesh, whose material keeps the faces in the link's colour that a
///   viewer's light does not reach. It collides as a box where its section is a rectangle, else as
///   an STL mesh. `place_links` says where it stands in y. Solids stand where they are; URDF knows
///   no capsule, so one becomes a cylinder between two spheres.
/// - A child whose frame is not its joint's hangs on a link without mass (see `turned_links`) by a
///   fixed joint: so each link's frame is the engine's.
/// - A joint without limits becomes a continuous one. URDF demands a velocity limit; where there is
///   none it is 10000 rad/s.
/// @param name        of the robot, and the beginning of the mesh files' names
/// @param mesh_folder URL of the folder in which viewers find the meshes
/// @throws std::invalid_argument for a joint that does not hang on the trunk, or for a link without
///         shapes of which the engine does not know the whole inertia
UrdfFiles make_urdf(const Specification& specification, const std::string& name,
                    const std::string& mesh_folder = "package://walker_sim/assets",
                    const UrdfDepths& depths = {});

}  // namespace walker
