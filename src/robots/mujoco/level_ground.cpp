#include "robots/mujoco/level_ground.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace walker::mujoco {
namespace {

constexpr double kStart = kTerrainStartPad * kColumn / 2;  // robot's place on the ground [m]

/// Points of the ground and edges of obstacles with this distance are at the same x.
constexpr double kTolerance = 1e-5;  // [m]

std::vector<Point> shifted(std::vector<Point> points, const Point& way) {
  for (Point& point : points) point = {point.x + way.x, point.y + way.y};
  return points;
}

/// Draws a ground, whose x are distances from the robot's place. The generator ends after its last
/// column, also in an obstacle, which then is left out.
Ground ground_from_start(Generator& generator, const Level& level) {
  Ground ground = draw_ground(generator, kGroundSize, false, level);
  for (Point& point : ground.points) point.x -= kStart;
  for (auto& corners : ground.obstacles) {
    for (Point& point : corners) point.x -= kStart;
  }
  for (Obstacle& obstacle : ground.of_level) {
    obstacle.left -= kStart;
    obstacle.right -= kStart;
  }
  if (ground.of_level.empty()) return ground;
  const Obstacle last = ground.of_level.back();
  if (last.right <= ground.points.back().x) return ground;
  ground.of_level.pop_back();
  ground.obstacles.resize(last.first_box);
  while (ground.points.back().x > last.left + kTolerance) ground.points.pop_back();
  return ground;
}

}  // namespace

std::optional<Level> level_of(const WorldValues& values) {
  if (values.empty()) return std::nullopt;
  const Level level = walker::level_of(values, kGroundSize, 0);
  const bool is_flat = level.ground_roughness == 0 && !level.has_obstacles();
  return is_flat ? std::nullopt : std::optional<Level>(level);
}

std::vector<WorldParameter> level_parameters() {
  LevelLimits limits{};
  limits.roughness = 0;
  limits.max_roughness = 10;
  limits.max_gap = 4;
  limits.stump_width = {0.02, 4};
  limits.stump_height = {0.02, 1};
  limits.max_float = 2;
  limits.tread_width = {0.2, 4};
  limits.rise = {0.02, 1};
  limits.spacing = {0.2, 40};
  return walker::level_parameters(
      limits, {"Factor of the ground's slopes, which at 1 are those of BipedalWalker's grass.", "",
               "0.2 m", "0.8 m",
               "Length of the ground between two obstacles, rounded to columns of 0.2 m, of which "
               "otherwise 5 to 9 are drawn; up to two columns longer."});
}

LevelGround::LevelGround(Generator& generator, const Level& level, const Point& origin)
    : origin_(origin), ground_(ground_from_start(generator, level)), line_(join()) {}

/// Joins the ground's points and the obstacles' outlines: sets `surface_` and returns `line_`.
GroundLine LevelGround::join() {
  surface_.reserve(2 * ground_.points.size());
  std::vector<std::vector<Point>> floating;
  auto point = ground_.points.begin();
  const auto end = ground_.points.end();
  for (const Obstacle& obstacle : ground_.of_level) {
    const auto& [left_bottom, right_bottom, right_top, left_top] =
        ground_.obstacles[obstacle.first_box];
    if (obstacle.kind == ObstacleKind::stump && left_bottom.y > obstacle.ground) {
      floating.push_back(shifted({left_bottom, left_top, right_top, right_bottom}, origin_));
      continue;
    }
    while (point->x < obstacle.left - kTolerance) surface_.push_back(*point++);
    while (point->x < obstacle.right - kTolerance) ++point;
    const double height_behind = point->y;
    while (point != end && point->x <= obstacle.right + kTolerance) ++point;
    surface_.push_back({obstacle.left, obstacle.ground});
    add_outline(obstacle);
    surface_.push_back({obstacle.right, height_behind});
  }
  surface_.insert(surface_.end(), point, end);
  return GroundLine(shifted(surface_, origin_), std::move(floating));
}

/// Adds the points between an obstacle's ends.
void LevelGround::add_outline(const Obstacle& obstacle) {
  const auto [kind, left, right, ground, first_box, num_boxes] = obstacle;
  if (kind == ObstacleKind::stump) {
    surface_.insert(surface_.end(), {{left, top_of(obstacle)}, {right, top_of(obstacle)}});
  } else if (kind == ObstacleKind::stairs) {
    for (std::size_t i = 1; i < num_boxes; ++i) {
      const Point& edge = ground_.obstacles[first_box + i][3];
      surface_.push_back({edge.x, surface_.back().y});
      surface_.push_back(edge);
    }
    surface_.push_back({right, surface_.back().y});
  } else if (right - left > 2 * kColumn + kTolerance) {
    const double bottom = ground - kPitDepth * kColumn;
    surface_.insert(surface_.end(), {{left + kColumn, ground},
                                     {left + kColumn, bottom},
                                     {right - kColumn, bottom},
                                     {right - kColumn, ground}});
  }
}

GroundBelow LevelGround::below(double x) const {
  const auto next =
      std::upper_bound(ground_.of_level.begin(), ground_.of_level.end(), x,
                       [](double value, const Obstacle& each) { return value < each.left; });
  if (next != ground_.of_level.begin() && x <= next[-1].right) {
    const Obstacle& obstacle = next[-1];
    if (obstacle.kind == ObstacleKind::pit) return {obstacle.ground, obstacle.ground};
    if (obstacle.kind == ObstacleKind::stump) return {obstacle.ground, top_of(obstacle)};
  }
  const auto behind =
      std::upper_bound(surface_.begin(), surface_.end(), x,
                       [](double value, const Point& each) { return value < each.x; });
  const Point& from = behind == surface_.begin() ? *behind : behind[-1];
  const Point& to = behind == surface_.end() ? from : *behind;
  const double share = from.x < to.x ? (x - from.x) / (to.x - from.x) : 0;
  const double ground = from.y + share * (to.y - from.y);
  return {ground, ground};
}

void LevelGround::describe(Scene& scene) const {
  constexpr Color kEarth{0.46, 0.50, 0.50, 1};
  constexpr Color kObstacle{0.93, 0.86, 0.72, 1};
  constexpr double kDepth = 1;   // of the earth below the lowest ground [m]
  constexpr double kShown = 20;  // length of the level ground at both ends, in tiles [m]
  scene = {};
  std::vector<Point> ground = shifted(ground_.points, origin_);
  const auto by_height = [](const Point& a, const Point& b) { return a.y < b.y; };
  const double bottom = std::min_element(ground.begin(), ground.end(), by_height)->y - kDepth;
  const auto [first, last] = std::pair{ground.front(), ground.back()};
  ground.insert(ground.begin(), {{first.x - kFarEnd, first.y}, {first.x - kShown, first.y}});
  ground.insert(ground.end(), {{last.x + kShown, last.y}, {last.x + kFarEnd, last.y}});
  for (std::size_t i = 0; i + 1 < ground.size(); ++i) {
    const Point& to = ground[i + 1];
    const bool has_tiles = ground[i].y == to.y && i > 0 && i + 2 < ground.size();
    for (Point from = ground[i]; from.x < to.x - kTolerance;) {
      Point end = to;
      if (has_tiles) end.x = std::min(to.x, kTile * (std::floor(from.x / kTile + kTolerance) + 1));
      const double tile = std::floor((from.x + end.x) / 2 / kTile);
      scene.surface_colors.push_back(kTileColors[static_cast<std::size_t>(std::llround(tile)) % 2]);
      scene.ground.push_back(
          {{{from.x, from.y}, {end.x, end.y}, {end.x, bottom}, {from.x, bottom}}, kEarth});
      from = end;
    }
  }
  for (const auto& corners : ground_.obstacles) {
    ScenePolygon& polygon = scene.obstacles.emplace_back(ScenePolygon{{}, kObstacle});
    for (const Point& point : corners) {
      polygon.points.push_back({origin_.x + point.x, origin_.y + point.y});
    }
  }
}

}  // namespace walker::mujoco
