// Terrain and clouds: pure functions of the random generator.
#pragma once

#include <array>
#include <vector>

#include "base/random.h"
#include "robots/bipedal_walker/constants.h"

namespace walker::bipedal_walker {

/// A point of Box2D's plane: x forward, y up [m].
struct Point {
  double x;
  double y;
};

struct Terrain {
  std::array<Point, kTerrainLength> ground{};   ///< each point is joined to the next by an edge
  std::vector<std::array<Point, 4>> obstacles;  ///< pit walls, stumps, stairs; left to right
};

using Cloud = std::array<Point, 5>;
using Clouds = std::array<Cloud, kTerrainLength / 20>;

/// Draws exactly what Gymnasium's `_generate_terrain` draws, in its order.
/// @param hardcore whether the terrain has stumps, stairs and pits
Terrain generate_terrain(Generator& generator, bool hardcore);

/// Draws exactly what Gymnasium's `_generate_clouds` draws, in its order.
Clouds generate_clouds(Generator& generator);

}  // namespace walker::bipedal_walker
