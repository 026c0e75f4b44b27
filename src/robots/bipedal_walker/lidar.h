// Ten rays from the hull to the ground.
#pragma once

#include <array>

#include "robots/bipedal_walker/constants.h"
#include "robots/bipedal_walker/terrain.h"

namespace walker::bipedal_walker {

class Physics;

struct RayHit {
  float fraction = 1;  ///< distance to the ground over kLidarRange; 1 if nothing is hit
  bool hit = false;
};

using LidarScan = std::array<RayHit, kLidarRays>;

/// Casts ray i from the hull's origin towards (sin 0.15 i, -cos 0.15 i): ray 0 straight down, later
/// ones further forward. The rays do not turn with the hull, and hit only terrain, not the legs.
/// @param terrain the terrain that `physics` was built with
/// @throws std::logic_error, Box2D's assertion, if the hull's position is not finite
void cast_lidar(const Physics& physics, const Terrain& terrain, LidarScan& scan);

}  // namespace walker::bipedal_walker
