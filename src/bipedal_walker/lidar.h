// Ten rays from the hull to the ground.
#pragma once

#include <array>

#include "bipedal_walker/box2d.h"
#include "bipedal_walker/constants.h"

namespace walker::bipedal_walker {

/// What one ray met.
struct RayHit {
  float fraction = 1;  ///< of kLidarRange at which the ray met the ground; 1: it met nothing
  bool hit = false;
};

using LidarScan = std::array<RayHit, kLidarRays>;

/// Casts ray i from `origin` towards (sin 0.15 i, -cos 0.15 i): straight down first, then ever more
/// forward. The rays do not turn with the hull and see the ground only, not the legs.
void cast_lidar(const b2World& world, const b2Vec2& origin, LidarScan& scan);

}  // namespace walker::bipedal_walker
