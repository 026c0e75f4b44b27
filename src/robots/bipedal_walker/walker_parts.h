// Which bodies and joints of a world are the walker.
#pragma once

#include <array>

#include <Box2D/Box2D.h>

#include "robots/bipedal_walker/kernel/kernel.h"

namespace walker::bipedal_walker {

/// In the order in which Box2D solves them: the chain from the second lower leg over the hull to
/// the first.
struct WalkerParts {
  b2World* world;
  std::array<b2Body*, kBodies> bodies;
  std::array<b2RevoluteJoint*, kJoints> joints;
};

}  // namespace walker::bipedal_walker
