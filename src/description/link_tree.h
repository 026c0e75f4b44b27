// The tree of links that a specification's joints make, as robot descriptions and viewers show it.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "walker_sim/specification.h"

namespace walker {

// How far bodies of a planar world reach in y, for the eye and for whoever collides with them [m].
// Masses stay in the plane y = 0.
constexpr double kTrunkDepth = 0.4;
constexpr double kLimbDepth = 0.16;

/// Where a link's prisms stand in y and how far they reach [m].
struct Place {
  double y = 0;
  double depth = 0;
};

/// The places of a planar world's links by name: branches of the trunk stand beside each other in
/// y, the first on the far side (+y).
/// @throws std::invalid_argument for a joint that does not hang on the trunk
std::map<std::string, Place> place_links(const Specification& specification);

/// What each joint turns, by name: its child, or, where the child's frame is not the joint's, the
/// link without mass on which the child is fixed, `<child>_hinge`; longer where that name is taken.
std::vector<std::string> turned_links(const Specification& specification);

}  // namespace walker
