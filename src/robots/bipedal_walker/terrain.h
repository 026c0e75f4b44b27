// Terrain and clouds: pure functions of the random generator.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "base/random.h"
#include "robots/bipedal_walker/constants.h"

namespace walker::bipedal_walker {

/// A point of Box2D's plane: x forward, y up [m].
struct Point {
  double x;
  double y;
};

/// A box on the ground, or above it.
struct Stumps {
  double width;      ///< [m]
  double height;     ///< [m]
  double clearance;  ///< between ground and box [m]
};

/// Flights of stairs, up or down.
struct Stairs {
  double tread_width;  ///< [m]
  double rise;         ///< of each tread [m]
  int num_treads;
};

/// A world's level. Obstacles of an episode have equal sizes. Any kind of obstacle that is given
/// replaces hardcore's.
struct Level {
  double ground_roughness = 1;             ///< factor of the grass's slope
  std::optional<double> obstacle_spacing;  ///< grass between obstacles [m]; absent: drawn
  std::optional<double> pit_gap;           ///< between a pit's walls [m]
  std::optional<Stumps> stumps;
  std::optional<Stairs> stairs;

  bool has_obstacles() const { return pit_gap || stumps || stairs; }
  bool is_gymnasiums() const {
    return ground_roughness == 1 && !obstacle_spacing && !has_obstacles();
  }
};

struct Terrain {
  std::array<Point, kTerrainLength> ground{};   ///< each point is joined to the next by an edge
  std::vector<std::array<Point, 4>> obstacles;  ///< boxes: pit walls, stumps, stairs; left to right
  bool obstacles_are_gymnasiums = true;         ///< false: a level's
  double bottom = 0;                            ///< lower end of the ground's picture [m]
};

using Cloud = std::array<Point, 5>;
using Clouds = std::array<Cloud, kTerrainLength / 20>;

/// Draws exactly what Gymnasium's `_generate_terrain` draws, in its order. A level's obstacles are
/// those of POET (uber-research/poet, bipedal_walker_custom.py), which draws their sizes.
/// @param hardcore whether the terrain has stumps, stairs and pits
Terrain generate_terrain(Generator& generator, bool hardcore, const Level& level = {});

/// Draws exactly what Gymnasium's `_generate_clouds` draws, in its order.
Clouds generate_clouds(Generator& generator);

}  // namespace walker::bipedal_walker
