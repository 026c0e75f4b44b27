#include "robots/mujoco/box_ground.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "base/shortest_text.h"

namespace walker::mujoco {
namespace {

constexpr double kStart = kTerrainStartPad * kColumn / 2;  // robot's place on the ground [m]
constexpr double kFar = 1e4;  // length of the level ground at both ends [m]

/// A thick tilted box beside a pit would reach through the pit's wall, which is a column wide.
constexpr double kThickness = kColumn;  // [m]

/// Points of the ground and edges of obstacles with this distance are at the same x.
constexpr double kTolerance = 1e-5;  // [m]

Point moved(const Point& point) { return {point.x - kStart, point.y}; }

double height_at(const Point& from, const Point& to, double x) {
  const double length = to.x - from.x;
  return length > 0 ? from.y + (x - from.x) / length * (to.y - from.y) : from.y;
}

/// @param side -1: the left edge, 1: the right one
Point upper_edge(const GroundBox& box, int side) {
  const auto [along, up] = box.direction;
  const double right = side * box.half_size[0];
  const double above = box.half_size[1];
  return {box.center[0] + along * right - up * above, box.center[1] + up * right + along * above};
}

/// Returns the sine of the angle by which the ground falls more steeply behind an edge; 0: it does
/// not.
double sine_of_ridge(const std::array<double, 2>& before, const std::array<double, 2>& behind) {
  const double sine = before[1] * behind[0] - before[0] * behind[1];
  const bool is_acute = before[0] * behind[0] + before[1] * behind[1] > 0;
  return is_acute || sine < 0 ? std::max(sine, 0.0) : 1.0;
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

void check_level(const World& world) {
  walker::check_level(world, kGroundSize, false, "");
  const auto range = world.find("lidar_range");
  if (range == world.end() || range->second.high <= kSensing) return;
  const std::vector<WorldParameter> levels = level_parameters();
  if (std::any_of(levels.begin(), levels.end(),
                  [&](const WorldParameter& level) { return world.count(level.name) != 0; })) {
    throw std::invalid_argument("lidar_range = " + shortest_text(range->second.high) +
                                " m: must be at most " + shortest_text(kSensing) +
                                " m in a world with a level");
  }
}

BoxGround::BoxGround(Generator& generator, const Level& level)
    : ground_(draw_ground(generator, kGroundSize, false, level)) {
  for (Point& point : ground_.points) point = moved(point);
  for (auto& corners : ground_.obstacles) {
    for (Point& point : corners) point = moved(point);
  }
  for (Obstacle& obstacle : ground_.of_level) {
    obstacle.left -= kStart;
    obstacle.right -= kStart;
  }
  cut_last_obstacle();
  std::vector<Point>& ground = ground_.points;
  ground.insert(ground.begin(), {ground.front().x - kFar, ground.front().y});
  ground.push_back({ground.back().x + kFar, ground.back().y});
  add_ground();
  for (const Obstacle& obstacle : ground_.of_level) add_obstacle(obstacle);
  std::stable_sort(boxes_.begin(), boxes_.end(),
                   [](const GroundBox& a, const GroundBox& b) { return a.left < b.left; });
  find_internal_edges();
  std::stable_sort(surfaces_.begin(), surfaces_.end(),
                   [](const Surface& a, const Surface& b) { return a.from.x < b.from.x; });
}

/// The generator ends after its last column, also in a pit.
void BoxGround::cut_last_obstacle() {
  if (ground_.of_level.empty()) return;
  const Obstacle last = ground_.of_level.back();
  if (last.right <= ground_.points.back().x) return;
  ground_.of_level.pop_back();
  ground_.obstacles.resize(last.first_box);
  while (ground_.points.back().x > last.left + kTolerance) ground_.points.pop_back();
}

/// Adds a box for every slope, and one for each stretch that is level.
void BoxGround::add_ground() {
  const std::vector<Point>& ground = ground_.points;
  for (std::size_t i = 0; i + 1 < ground.size();) {
    const Place place = place_of(ground[i], ground[i + 1]);
    std::size_t end = i + 1;
    if (ground[i].y == ground[end].y) {
      while (end + 1 < ground.size() && ground[end + 1].y == ground[i].y &&
             place_of(ground[end], ground[end + 1]) == place) {
        ++end;
      }
    }
    if (place != Place::hidden) add_box(ground[i], ground[end], kThickness);
    if (place == Place::open) surfaces_.push_back({ground[i], ground[end]});
    i = end;
  }
}

BoxGround::Place BoxGround::place_of(const Point& from, const Point& to) const {
  const auto behind =
      std::upper_bound(ground_.of_level.begin(), ground_.of_level.end(), from.x + kTolerance,
                       [](double x, const Obstacle& obstacle) { return x < obstacle.left; });
  if (behind == ground_.of_level.begin()) return Place::open;
  const Obstacle& obstacle = behind[-1];
  if (to.x > obstacle.right + kTolerance || obstacle.kind == ObstacleKind::stump) {
    return Place::open;
  }
  const bool is_below_gap = obstacle.kind == ObstacleKind::pit &&
                            to.x > obstacle.left + kColumn + kTolerance &&
                            from.x < obstacle.right - kColumn - kTolerance;
  return is_below_gap ? Place::pit : Place::hidden;
}

void BoxGround::add_obstacle(const Obstacle& obstacle) {
  for (std::size_t i = 0; i < obstacle.num_boxes; ++i) {
    const std::array<Point, 4>& corners = ground_.obstacles[obstacle.first_box + i];
    const Point& left_bottom = corners[0];
    const Point& left = corners[3];
    const Point& right = corners[2];
    const double height = left.y - left_bottom.y;
    if (obstacle.kind == ObstacleKind::stump) {
      add_box(left, right, height);
      stumps_.push_back({left, right});
    } else {
      add_box(left, right, height + kThickness);
      if (obstacle.kind == ObstacleKind::stairs) surfaces_.push_back({left, right});
    }
  }
  if (obstacle.kind == ObstacleKind::pit) {
    surfaces_.push_back({{obstacle.left, obstacle.ground}, {obstacle.right, obstacle.ground}});
  }
}

/// Adds a box below the line between the two points.
void BoxGround::add_box(const Point& from, const Point& to, double thickness) {
  const double length =
      std::sqrt((to.x - from.x) * (to.x - from.x) + (to.y - from.y) * (to.y - from.y));
  if (length == 0) return;
  GroundBox box;
  box.direction = {(to.x - from.x) / length, (to.y - from.y) / length};
  const auto [along, up] = box.direction;
  box.half_size = {length / 2, thickness / 2};
  box.center = {(from.x + to.x) / 2 + up * thickness / 2,
                (from.y + to.y) / 2 - along * thickness / 2};
  const double reach = along * box.half_size[0] + std::abs(up) * box.half_size[1];
  box.left = box.center[0] - reach;
  box.right = box.center[0] + reach;
  box.top = std::max(from.y, to.y);
  boxes_.push_back(box);
}

/// Limits the tilts of contacts at the upper edges at which two boxes meet.
void BoxGround::find_internal_edges() {
  struct Edge {
    Point point;
    GroundBox* box;
  };
  std::vector<Edge> right_edges;
  for (GroundBox& box : boxes_) right_edges.push_back({upper_edge(box, 1), &box});
  std::stable_sort(right_edges.begin(), right_edges.end(),
                   [](const Edge& a, const Edge& b) { return a.point.x < b.point.x; });
  for (GroundBox& box : boxes_) {
    const Point point = upper_edge(box, -1);
    for (auto edge = std::lower_bound(right_edges.begin(), right_edges.end(), point.x - kTolerance,
                                      [](const Edge&each, double x) { return each.point.x < x; });
         edge != right_edges.end() && edge->point.x <= point.x + kTolerance; ++edge) {
      if (std::abs(edge->point.y - point.y) > kTolerance) continue;
      const double sine = sine_of_ridge(edge->box->direction, box.direction);
      edge->box->max_tilt[1] = sine;
      box.max_tilt[0] = sine;
    }
  }
}

GroundBelow BoxGround::below(double x) const {
  constexpr std::ptrdiff_t kOverlapping = 3;
  const auto end =
      std::upper_bound(surfaces_.begin() + 1, surfaces_.end(), x,
                       [](double value, const Surface& each) { return value < each.from.x; });
  GroundBelow below;
  below.ground = height_at(end[-1].from, end[-1].to, std::min(x, end[-1].to.x));
  const auto begin = end - std::min(kOverlapping, end - surfaces_.begin());
  for (auto each = begin; each != end; ++each) {
    if (x > each->to.x) continue;
    below.ground = std::max(below.ground, height_at(each->from, each->to, x));
  }
  below.top = below.ground;
  const auto stump =
      std::upper_bound(stumps_.begin(), stumps_.end(), x,
                       [](double value, const Surface& each) { return value < each.from.x; });
  if (stump != stumps_.begin() && x <= stump[-1].to.x) {
    below.top = std::max(below.top, stump[-1].from.y);
  }
  return below;
}

void BoxGround::describe(double x, double z, Scene& scene) const {
  constexpr std::array<Color, 2> kSurface{{{0.85, 0.89, 0.87, 1}, {0.55, 0.65, 0.66, 1}}};
  constexpr Color kEarth{0.46, 0.50, 0.50, 1};
  constexpr Color kObstacle{0.93, 0.86, 0.72, 1};
  constexpr double kDepth = 1;             // of the earth below the lowest ground [m]
  constexpr double kShown = 20;            // length of the level ground at both ends, in tiles [m]
  constexpr double kTile = 2.5 * kColumn;  // of level ground [m]
  scene = {};
  const std::vector<Point>& ground = ground_.points;
  const auto by_height = [](const Point& a, const Point& b) { return a.y < b.y; };
  const double lowest = std::min_element(ground.begin(), ground.end(), by_height)->y;
  const double bottom = z + lowest - kDepth;
  const auto add = [&](const Point& from, const Point& to, std::size_t tone) {
    scene.ground.push_back(
        {{{x + from.x, z + from.y}, {x + to.x, z + to.y}, {x + to.x, bottom}, {x + from.x, bottom}},
         kEarth});
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
  const Point& first = ground[1];
  const Point& last = ground[ground.size() - 2];
  add(ground.front(), {first.x - kShown, first.y}, 0);
  add_tiles({first.x - kShown, first.y}, first);
  for (std::size_t i = 1; i + 2 < ground.size(); ++i) {
    if (ground[i].y == ground[i + 1].y) {
      add_tiles(ground[i], ground[i + 1]);
    } else {
      add(ground[i], ground[i + 1], tone_at((ground[i].x + ground[i + 1].x) / 2));
    }
  }
  add_tiles(last, {last.x + kShown, last.y});
  add({last.x + kShown, last.y}, ground.back(), 0);
  for (const auto& corners : ground_.obstacles) {
    ScenePolygon polygon{{}, kObstacle};
    for (const Point& point : corners) polygon.points.push_back({x + point.x, z + point.y});
    scene.obstacles.push_back(polygon);
  }
}

}  // namespace walker::mujoco
