// Levels of worlds, and the ground that a random generator draws for one.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "base/random.h"
#include "walker_sim/world.h"

namespace walker {

// Gymnasium's constants (gymnasium/envs/box2d, 1.4.0). Grounds of other sizes have its proportions.
constexpr double kTerrainStep = 14 / 30.0;  // width of a column [m]
constexpr int kTerrainGrass = 10;     // exclusive upper bound of the grass between obstacles; steps
constexpr int kTerrainStartPad = 20;  // flat steps before the first bump

/// A point of the plane of motion: x forward, y up [m].
struct Point {
  double x;
  double y;
};

/// A box on the ground, or above it.
struct Stumps {
  double width;      ///< [m]
  double height;     ///< [m]
  double clearance;  ///< between ground and box [m]

  friend bool operator==(const Stumps& a, const Stumps& b) {
    return a.width == b.width && a.height == b.height && a.clearance == b.clearance;
  }
};

/// Flights of stairs, up or down.
struct Stairs {
  double tread_width;  ///< [m]
  double rise;         ///< of each tread [m]
  int num_treads;
  bool varies = false;  ///< whether each flight draws its number of treads, from 0 to num_treads

  friend bool operator==(const Stairs& a, const Stairs& b) {
    return a.tread_width == b.tread_width && a.rise == b.rise && a.num_treads == b.num_treads &&
           a.varies == b.varies;
  }
};

/// A world's level. Obstacles of an episode have equal sizes, except stairs that vary. If the level
/// has any obstacle, hardcore's own obstacles are not made.
struct Level {
  double ground_roughness = 1;             ///< factor of the slopes of Gymnasium's grass
  std::optional<double> obstacle_spacing;  ///< grass between obstacles [m]; absent: drawn
  std::optional<double> pit_gap;           ///< between a pit's walls [m]
  std::optional<Stumps> stumps;
  std::optional<Stairs> stairs;

  bool has_obstacles() const { return pit_gap || stumps || stairs; }
  bool is_gymnasiums() const {
    return ground_roughness == 1 && !obstacle_spacing && !has_obstacles();
  }
  friend bool operator==(const Level& a, const Level& b) {
    return a.ground_roughness == b.ground_roughness && a.obstacle_spacing == b.obstacle_spacing &&
           a.pit_gap == b.pit_gap && a.stumps == b.stumps && a.stairs == b.stairs;
  }
  friend bool operator!=(const Level& a, const Level& b) { return !(a == b); }
};

/// Sizes of one robot's ground, and defaults for the obstacle sizes that a world does not set.
struct GroundSize {
  int num_columns;
  double column;        ///< width of a column [m]
  double start_height;  ///< of the ground at the start [m]
  Stumps stumps;
  Stairs stairs;

  /// Between the start pad and the far end [m].
  double obstacle_length() const {
    return (num_columns - kTerrainGrass - kTerrainStartPad) * column;
  }
};

/// Depth of a pit [columns].
constexpr int kPitDepth = 4;

enum class ObstacleKind { stump, stairs, pit };

/// An obstacle of a level, made of one or more boxes: a stump, the treads of a flight or the walls
/// of a pit.
struct Obstacle {
  ObstacleKind kind;
  double left;    ///< [m]
  double right;   ///< [m]
  double ground;  ///< height of the ground on the left [m]
  std::size_t first_box;
  std::size_t num_boxes;
};

/// What was drawn: a line, and the boxes on it or in it.
struct Ground {
  std::vector<Point> points;                    ///< each is joined to the next by an edge
  std::vector<std::array<Point, 4>> obstacles;  ///< boxes: pit walls, stumps, stairs; left to right
  std::vector<Obstacle> of_level;               ///< the obstacles that a level has
  bool obstacles_are_gymnasiums = true;         ///< false: a level's
  double bottom = 0;                            ///< lower end of the ground's picture [m]
};

/// Draws exactly what Gymnasium's `_generate_terrain` draws, in its order. A level's obstacles are
/// those of POET (uber-research/poet), which draws their sizes.
///
/// Point i of the ground is at x = i column, with the column's width in m. The ground consists of
/// sections: 20 columns of flat grass, then alternately an obstacle and 5 to 9 columns of grass;
/// without obstacles all is grass. Kinds and sizes are drawn. The first column of a section repeats
/// the height y of the last one. For the others:
///
///   grass   slope = 0.8 slope + 0.01 sign(start_height - y) + u / 30,   u uniform in [-1, 1),
///           u = 0 up to column 20
///           y    += ground_roughness (column / (14/30 m)) slope
///   stump   y stays; a square box of n = 1 or 2 columns
///   pit     4 columns lower for n = 3 or 4 columns; walls at its first column and n columns on
///   stairs  n = 3 or 4 treads of 4 columns, up or down by one column each
///
/// A level's sizes replace those of the obstacles, and `obstacle_spacing` the length of the grass.
///
/// Source: Gymnasium 1.4.0, envs/box2d, _generate_terrain.
/// @param hardcore whether the ground has stumps, stairs and pits
Ground draw_ground(Generator& generator, const GroundSize& size, bool hardcore, const Level& level);

/// Returns the range of this name, or the number `absent`.
inline WorldRange range_or(const World& world, const std::string& name, double absent) {
  const auto found = world.find(name);
  return found == world.end() ? WorldRange{absent, absent} : found->second;
}

/// @param roughness of a world that does not name it
Level level_of(const WorldValues& values, const GroundSize& size, double roughness);

/// Limits of a level's parameters.
struct LevelLimits {
  double roughness;  ///< default
  double max_roughness;
  double max_gap;           ///< [m]
  WorldRange stump_width;   ///< [m]
  WorldRange stump_height;  ///< [m]
  double max_float;         ///< [m]
  WorldRange tread_width;   ///< [m]
  WorldRange rise;          ///< [m]
  WorldRange spacing;       ///< [m]
};

/// Texts for the descriptions of a level's parameters.
struct LevelTexts {
  std::string roughness;  ///< description of ground_roughness
  std::string instead;    ///< what the obstacles replace, such as ", in place of hardcore's"
  std::string column;     ///< default size of stumps and rise of stairs, such as "14/30 m"
  std::string tread;      ///< default width of a tread
  std::string spacing;    ///< description of obstacle_spacing
};

std::vector<WorldParameter> level_parameters(const LevelLimits& limits, const LevelTexts& texts);

/// Refuses obstacles that are longer than their part of the ground, and a spacing without
/// obstacles.
/// @param hardcore whether the environment has obstacles of its own
/// @param advice   where else there are obstacles; empty: nowhere
/// @throws std::invalid_argument naming the parameters, their values and what is allowed
void check_level(const World& world, const GroundSize& size, bool hardcore,
                 const std::string& advice);

}  // namespace walker
