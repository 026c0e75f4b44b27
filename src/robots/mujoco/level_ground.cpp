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

double height_at(const Point& from, const Point& to, double x) {
  return from.y + (x - from.x) / (to.x - from.x) * (to.y - from.y);
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

void check_level(const World& world) { walker::check_level(world, kGroundSize, false, ""); }

LevelGround::LevelGround(Generator& generator, const Level& level, const Point& origin)
    : origin_(origin), ground_(draw_ground(generator, kGroundSize, false, level)) {
  ground_.points = shifted(std::move(ground_.points), {-kStart, 0});
  for (auto& corners : ground_.obstacles) {
    for (Point& point : corners) point.x -= kStart;
  }
  for (Obstacle& obstacle : ground_.of_level) {
    obstacle.left -= kStart;
    obstacle.right -= kStart;
  }
  cut_last_obstacle();
  make_lines();
}

/// The generator ends after its last column, also in a pit.
void LevelGround::cut_last_obstacle() {
  if (ground_.of_level.empty()) return;
  const Obstacle last = ground_.of_level.back();
  if (last.right <= ground_.points.back().x) return;
  ground_.of_level.pop_back();
  ground_.obstacles.resize(last.first_box);
  while (ground_.points.back().x > last.left + kTolerance) ground_.points.pop_back();
}

/// Joins the ground's points and the obstacles' outlines to the lines on which limbs stand and
/// walk.
void LevelGround::make_lines() {
  std::vector<Point> line;
  line.reserve(2 * ground_.points.size());
  walkway_.reserve(2 * ground_.points.size());
  std::vector<std::vector<Point>> floating;
  auto point = ground_.points.begin();
  const auto end = ground_.points.end();
  for (const Obstacle& obstacle : ground_.of_level) {
    const auto& first_box = ground_.obstacles[obstacle.first_box];
    const bool floats = obstacle.kind == ObstacleKind::stump && first_box[0].y > obstacle.ground;
    if (obstacle.kind == ObstacleKind::stump) {
      stumps_.push_back({obstacle.left, obstacle.right, first_box[2].y});
    }
    if (floats) {
      const auto& [left_bottom, right_bottom, right_top, left_top] = first_box;
      floating.push_back({left_bottom, left_top, right_top, right_bottom});
      continue;
    }
    for (; point->x < obstacle.left - kTolerance; ++point) add(*point, line);
    while (point->x < obstacle.right - kTolerance) ++point;
    const double height_behind = point->y;
    while (point != end && point->x <= obstacle.right + kTolerance) ++point;
    add_obstacle(obstacle, height_behind, line);
  }
  for (; point != end; ++point) add(*point, line);
  for (std::vector<Point>& outline : floating) outline = shifted(std::move(outline), origin_);
  line_ = GroundLine(shifted(std::move(line), origin_), std::move(floating));
}

void LevelGround::add(const Point& point, std::vector<Point>& line) {
  line.push_back(point);
  walkway_.push_back(point);
}

/// @param height_behind of the ground at the obstacle's right end [m]
void LevelGround::add_obstacle(const Obstacle& obstacle, double height_behind,
                               std::vector<Point>& line) {
  const double left = obstacle.left;
  const double right = obstacle.right;
  const double ground = obstacle.ground;
  add({left, ground}, line);
  if (obstacle.kind == ObstacleKind::stump) {
    const double top = stumps_.back().top;
    line.insert(line.end(), {{left, top}, {right, top}});
  } else if (obstacle.kind == ObstacleKind::stairs) {
    for (std::size_t i = 1; i < obstacle.num_boxes; ++i) {
      const Point& edge = ground_.obstacles[obstacle.first_box + i][3];
      add({edge.x, walkway_.back().y}, line);
      add(edge, line);
    }
    add({right, walkway_.back().y}, line);
  } else if (right - left > 2 * kColumn + kTolerance) {
    const double bottom = ground - kPitDepth * kColumn;
    line.insert(line.end(), {{left + kColumn, ground},
                             {left + kColumn, bottom},
                             {right - kColumn, bottom},
                             {right - kColumn, ground}});
  }
  add({right, height_behind}, line);
}

GroundBelow LevelGround::below(double x) const {
  const auto behind =
      std::upper_bound(walkway_.begin(), walkway_.end(), x,
                       [](double value, const Point& each) { return value < each.x; });
  GroundBelow below;
  if (behind == walkway_.begin()) {
    below.ground = walkway_.front().y;
  } else if (behind == walkway_.end()) {
    below.ground = walkway_.back().y;
  } else {
    below.ground = height_at(behind[-1], *behind, x);
  }
  below.top = below.ground;
  const auto stump =
      std::upper_bound(stumps_.begin(), stumps_.end(), x,
                       [](double value, const Top& each) { return value < each.left; });
  if (stump != stumps_.begin() && x <= stump[-1].right) {
    below.top = std::max(below.top, stump[-1].top);
  }
  return below;
}

void LevelGround::describe(Scene& scene) const {
  constexpr std::array<Color, 2> kSurface{{{0.85, 0.89, 0.87, 1}, {0.55, 0.65, 0.66, 1}}};
  constexpr Color kEarth{0.46, 0.50, 0.50, 1};
  constexpr Color kObstacle{0.93, 0.86, 0.72, 1};
  constexpr double kDepth = 1;             // of the earth below the lowest ground [m]
  constexpr double kShown = 20;            // length of the level ground at both ends, in tiles [m]
  constexpr double kTile = 2.5 * kColumn;  // of level ground [m]
  scene = {};
  const std::vector<Point> ground = shifted(ground_.points, origin_);
  const auto by_height = [](const Point& a, const Point& b) { return a.y < b.y; };
  const double lowest = std::min_element(ground.begin(), ground.end(), by_height)->y;
  const double bottom = lowest - kDepth;
  const auto add = [&](const Point& from, const Point& to, std::size_t tone) {
    scene.ground.push_back(
        {{{from.x, from.y}, {to.x, to.y}, {to.x, bottom}, {from.x, bottom}}, kEarth});
    scene.surface_colors.push_back(kSurface[tone % 2]);
  };
  const auto tone_at = [](double at) {
    return static_cast<std::size_t>(std::llround(std::floor(at / kTile))) % 2;
  };
  const auto add_tiles = [&](Point from, const Point& to) {
    while (from.x < to.x - kTolerance) {
      const Point end{std::min(to.x, kTile * (std::floor(from.x / kTile + kTolerance) + 1)), to.y};
      add(from, end, tone_at((from.x + end.x) / 2));
      from = end;
    }
  };
  const auto [first, last] = std::pair{ground.front(), ground.back()};
  add({first.x - kFarEnd, first.y}, {first.x - kShown, first.y}, 0);
  add_tiles({first.x - kShown, first.y}, first);
  for (std::size_t i = 0; i + 1 < ground.size(); ++i) {
    if (ground[i].y == ground[i + 1].y) {
      add_tiles(ground[i], ground[i + 1]);
    } else {
      add(ground[i], ground[i + 1], tone_at((ground[i].x + ground[i + 1].x) / 2));
    }
  }
  add_tiles(last, {last.x + kShown, last.y});
  add({last.x + kShown, last.y}, {last.x + kFarEnd, last.y}, 0);
  for (const auto& corners : ground_.obstacles) {
    ScenePolygon polygon{{}, kObstacle};
    for (const Point& point : corners) {
      polygon.points.push_back({origin_.x + point.x, origin_.y + point.y});
    }
    scene.obstacles.push_back(polygon);
  }
}

}  // namespace walker::mujoco
