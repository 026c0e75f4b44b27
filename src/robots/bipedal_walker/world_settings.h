// The world's parameters of BipedalWalker: level, physics, range of the lidar.
#pragma once

#include <vector>

#include "robots/bipedal_walker/constants.h"
#include "robots/bipedal_walker/physics.h"
#include "robots/level.h"
#include "walker_sim/world.h"

namespace walker::bipedal_walker {

/// Gymnasium's ground, with its smallest obstacles.
constexpr GroundSize kGroundSize{kTerrainLength,
                                 kTerrainStep,
                                 kTerrainHeight,
                                 {kTerrainStep, kTerrainStep, 0},
                                 {4 * kTerrainStep, kTerrainStep, 3}};

/// A world, Gymnasium's by default.
struct WorldSettings {
  Level level;
  Dynamics dynamics;
  double lidar_range = kLidarRange;     ///< [m]
  double initial_force = kInitialPush;  ///< largest horizontal force on the hull at the reset [N]
};

bool operator==(const WorldSettings& a, const WorldSettings& b);

/// Draws exactly what Gymnasium's `_generate_terrain` draws, in its order.
/// @param hardcore whether the ground has stumps, stairs and pits
inline Ground draw_ground(Generator& generator, bool hardcore, const Level& level = {}) {
  return walker::draw_ground(generator, kGroundSize, hardcore, level);
}

/// Ignores the names that are not in `world_parameters`.
WorldSettings settings_of(const WorldValues& values);

/// @param hardcore whether the environment has obstacles of its own
std::vector<WorldParameter> world_parameters(bool hardcore);

/// Refuses parameters that contradict each other or have no effect beside the others.
/// @param hardcore whether the environment has obstacles of its own
/// @throws std::invalid_argument naming the parameters, their values and what is allowed
void check_world(const World& world, bool hardcore);

}  // namespace walker::bipedal_walker
