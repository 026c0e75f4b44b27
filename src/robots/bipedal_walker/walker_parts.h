// The walker's bodies and joints in a Box2D world.
#pragma once

#include <array>

#include <Box2D/Box2D.h>

#include "robots/bipedal_walker/kernel/kernel.h"

namespace walker::bipedal_walker {

/// Bodies and joints in the order in which Box2D solves them: the chain from the second lower leg
/// over the hull to the first lower leg.
struct WalkerParts {
  b2World* world;
  std::array<b2Body*, kBodies> bodies;
  std::array<b2RevoluteJoint*, kJoints> joints;
};

}  // namespace walker::bipedal_walker
