// Ten rays from the hull to the ground.
#pragma once

#include <array>

#include <Box2D/Box2D.h>

#include "robots/bipedal_walker/constants.h"
#include "robots/bipedal_walker/terrain.h"

namespace walker::bipedal_walker {

class Physics;

/// What one ray met.
struct RayHit {
  float fraction = 1;  ///< of kLidarRange at which the ray met the ground; 1: it met nothing
  bool hit = false;
};

using LidarScan = std::array<RayHit, kLidarRays>;
using RayEnds = std::array<b2Vec2, kLidarRays>;

/// Casts ray i from the hull's origin towards (sin 0.15 i, -cos 0.15 i): straight down first, then
/// ever more forward. The rays do not turn with the hull and see the ground only, not the legs.
/// @param terrain what `physics` was built with
/// @throws std::logic_error, Box2D's assertion, when the hull is nowhere
void cast_lidar(const Physics& physics, const Terrain& terrain, LidarScan& scan);

/// Finds where the segments from `origin` to `ends` meet the ground first. The ends go from left to
/// right.
///
/// Looks at the pieces of ground below the rays alone, by Box2D's formulas.
void cast_rays(const Physics& physics, const Terrain& terrain, const b2Vec2& origin,
               const RayEnds& ends, LidarScan& scan);

}  // namespace walker::bipedal_walker
