// All that a world of Box2D carries from one step to the next, for comparisons to the bit.
#pragma once

#include <cstdint>
#include <vector>

#include "robots/bipedal_walker/physics.h"

namespace walker::bipedal_walker {

/// Positions, velocities, forces and sleep of all bodies; impulses and limits of the joints;
/// contacts in their order, with impulses and flags; the tree of bounding boxes, node by node.
std::vector<std::uint32_t> words_of(Physics& physics);

}  // namespace walker::bipedal_walker
