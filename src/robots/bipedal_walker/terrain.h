// Terrain and clouds: pure functions of the random generator.
#pragma once

#include <array>

#include "base/random.h"
#include "robots/bipedal_walker/constants.h"
#include "robots/level.h"

namespace walker::bipedal_walker {

/// Gymnasium's course, with its smallest obstacles.
constexpr CourseSize kCourseSize{kTerrainLength,
                                 kTerrainStep,
                                 kTerrainHeight,
                                 {kTerrainStep, kTerrainStep, 0},
                                 {4 * kTerrainStep, kTerrainStep, 3}};

using Cloud = std::array<Point, 5>;
using Clouds = std::array<Cloud, kTerrainLength / 20>;

/// Draws exactly what Gymnasium's `_generate_terrain` draws, in its order.
/// @param hardcore whether the terrain has stumps, stairs and pits
Terrain generate_terrain(Generator& generator, bool hardcore, const Level& level = {});

/// Draws exactly what Gymnasium's `_generate_clouds` draws, in its order.
Clouds generate_clouds(Generator& generator);

}  // namespace walker::bipedal_walker
