// What shortcut_player writes of each reset and step.
#pragma once

#include <array>

#include "robots/bipedal_walker/observation.h"
#include "robots/bipedal_walker/physics.h"

namespace walker::bipedal_walker {

/// Observation; reward, terminated; position and orientation of each link; position, velocity and
/// effort of each joint; velocity, acceleration and angular velocity of the hull.
using ShortcutRow = std::array<double, kObservationSize + 2 + (3 + 4) * (kJointCount + 1) +
                                           3 * kJointCount + std::size_t{3} * 3>;

constexpr int kShortcutRounds = 21;

}  // namespace walker::bipedal_walker
