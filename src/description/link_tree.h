// Placement and naming of a specification's links in robot descriptions and viewers.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "walker_sim/specification.h"

namespace walker {

// Depth along y of a planar world's bodies, for display and collision [m]. Masses stay in the plane
// y = 0.
constexpr double kTrunkDepth = 0.4;
constexpr double kLimbDepth = 0.16;

/// Position of a link's prisms along y, and their depth [m].
struct Place {
  double y = 0;
  double depth = 0;
};

/// Returns the places of a planar world's links by name. Branches of the trunk stand beside each
/// other in y, the first on the far side (+y).
/// @throws std::invalid_argument for a joint that is not connected to the trunk
std::map<std::string, Place> place_links(const Specification& specification);

/// Returns the name of the link that each joint turns: its child or, if the child's frame differs
/// from the joint's, `<child>_hinge`, a massless link on which the child is fixed. If that name is
/// taken, `_hinge` is appended again.
std::vector<std::string> turned_links(const Specification& specification);

}  // namespace walker
