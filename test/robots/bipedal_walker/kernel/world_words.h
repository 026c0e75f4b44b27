// State that a Box2D world carries from one step to the next, for comparison bit by bit.
#pragma once

#include <cstdint>
#include <vector>

#include "robots/bipedal_walker/physics.h"

namespace walker::bipedal_walker {

/// Returns positions, velocities, forces and sleep times of the bodies; impulses and limits of the
/// joints; contacts in list order, with impulses and flags; all nodes of the broad-phase tree.
std::vector<std::uint32_t> words_of(Physics& physics);

}  // namespace walker::bipedal_walker
