#include <algorithm>
#include <cmath>
#include <utility>

#include "drawing/polygons.h"

namespace walker {
namespace {

Color with_alpha(const Color& color, double alpha) { return {color[0], color[1], color[2], alpha}; }

/// Replaces every coordinate by `place(coordinate, centre)`; the centre is the mean of the points.
template <typename Place>
Outline around_center(Outline outline, const Place& place) {
  PlanePoint sum{};
  for (const PlanePoint& point : outline) sum = {sum[0] + point[0], sum[1] + point[1]};
  const auto count = static_cast<double>(outline.size());
  for (PlanePoint& point : outline) {
    point = {place(point[0], sum[0] / count), place(point[1], sum[1] / count)};
  }
  return outline;
}

/// Chaikin's algorithm: each round replaces every corner by two points, a quarter along its edges.
Outline rounded(Outline outline, int rounds) {
  constexpr double kNear = 0.75;
  constexpr double kFar = 0.25;
  for (int round = 0; round < rounds; ++round) {
    Outline finer;
    finer.reserve(2 * outline.size());
    for (std::size_t i = 0; i < outline.size(); ++i) {
      const PlanePoint& a = outline[i];
      const PlanePoint& b = outline[(i + 1) % outline.size()];
      finer.push_back({kNear * a[0] + kFar * b[0], kNear * a[1] + kFar * b[1]});
      finer.push_back({kFar * a[0] + kNear * b[0], kFar * a[1] + kNear * b[1]});
    }
    outline = std::move(finer);
  }
  return outline;
}

// The world is the plane y = 0, seen from -y. These depths are only visual [m].
constexpr Depth kGroundDepth{-2, 2};
constexpr Depth kObstacleDepth{-2.02, 2.02};  // more than the ground's, against flicker
constexpr double kGrassHeight = 0.12;         // grass that hangs over the ground's edge
constexpr double kFlagY = 1;                  // behind the walker
constexpr double kNearestCloudY = 7;
constexpr double kCloudSpacing = 1.5;  // in y, between consecutive clouds

constexpr double kOutlineWidth = 0.04;
constexpr double kPoleWidth = 0.07;

constexpr Color kOutlineColor{0.6, 0.6, 0.6, 1};
constexpr Color kPoleColor{0.2, 0.2, 0.22, 1};

/// Adds the earth below the surface, darker with depth, on the near and on the far side.
void add_earth(const Outline& outline, const Color& color, Drawing& triangles) {
  constexpr double kDarkness = 0.62;
  Outline earth = outline;
  earth[0][1] -= kGrassHeight;
  earth[1][1] -= kGrassHeight;
  std::vector<Color> colors(earth.size(), shaded(color, kDarkness));
  colors[0] = colors[1] = color;
  add_face(earth, kGroundDepth.near, colors, triangles);
  add_face(earth, kGroundDepth.far, colors, triangles);
}

/// An interval of x.
struct Interval {
  double left;
  double right;
};

/// Removes an interval from others.
std::vector<Interval> without(const std::vector<Interval>& all, const Interval& removed) {
  std::vector<Interval> rest;
  for (const auto& [left, right] : all) {
    if (left < removed.left) rest.push_back({left, std::min(right, removed.left)});
    if (right > removed.right) rest.push_back({std::max(left, removed.right), right});
  }
  return rest;
}

/// Returns the height of the line through `a` and `b` at `x`; a.x != b.x.
double height_at(double x, const PlanePoint& a, const PlanePoint& b) {
  return a[1] + (x - a[0]) / (b[0] - a[0]) * (b[1] - a[1]);
}

/// Returns the intervals of the surface where no side of an obstacle is in the same plane: rviz
/// would show pieces of both.
std::vector<Interval> uncovered(const PlanePoint& from, const PlanePoint& to,
                                const std::vector<ScenePolygon>& obstacles) {
  constexpr double kTolerance = 1e-4;  // [m]
  std::vector<Interval> parts{{from[0], to[0]}};
  for (const auto& [points, color] : obstacles) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      const PlanePoint& a = points[i];
      const PlanePoint& b = points[(i + 1) % points.size()];
      const double left = std::max(from[0], std::min(a[0], b[0]));
      const double right = std::min(to[0], std::max(a[0], b[0]));
      if (right - left < kTolerance) continue;
      const auto is_flush = [&](double x) {
        return std::abs(height_at(x, a, b) - height_at(x, from, to)) < kTolerance;
      };
      if (is_flush(left) && is_flush(right)) parts = without(parts, {left, right});
    }
  }
  return parts;
}

/// Adds the surface and its edge, which hangs over the earth.
void add_grass(const PlanePoint& from, const PlanePoint& to, const Color& color,
               const std::vector<ScenePolygon>& obstacles, Drawing& triangles) {
  constexpr double kFarShade = 0.8;
  constexpr double kEdgeShade = 0.88;
  for (const auto& [left, right] : uncovered(from, to, obstacles)) {
    const PlanePoint begin = left == from[0] ? from : PlanePoint{left, height_at(left, from, to)};
    const PlanePoint end = right == to[0] ? to : PlanePoint{right, height_at(right, from, to)};
    add_wall(begin, end, kGroundDepth, color, shaded(color, kFarShade), triangles);
  }
  const Outline edge{from, to, {to[0], to[1] - kGrassHeight}, {from[0], from[1] - kGrassHeight}};
  const std::vector<Color> colors(edge.size(), shaded(color, kEdgeShade));
  add_face(edge, kGroundDepth.near, colors, triangles);
  add_face(edge, kGroundDepth.far, colors, triangles);
}

Drawing ground_drawing(const Scene& scene) {
  constexpr double kEndShade = 0.8;
  Drawing drawing{"ground"};
  for (std::size_t i = 0; i < scene.ground.size(); ++i) {
    const auto& [outline, color] = scene.ground[i];
    if (!is_drawable(outline)) continue;
    add_earth(outline, color, drawing);
    const bool has_surface = i < scene.surface_colors.size();
    add_grass(outline[0], outline[1], has_surface ? scene.surface_colors[i] : color,
              scene.obstacles, drawing);
    // Faces at both ends of the ground; those between its pieces are hidden.
    const Color end_color = shaded(color, kEndShade);
    if (i == 0) {
      add_wall(outline[0], outline.back(), kGroundDepth, end_color, end_color, drawing);
    }
    if (i + 1 == scene.ground.size()) {
      add_wall(outline[1], outline[2], kGroundDepth, end_color, end_color, drawing);
    }
  }
  return drawing;
}

void add_obstacle(const ScenePolygon& obstacle, Drawing& triangles, Drawing& lines) {
  constexpr double kFaceShade = 0.96;
  constexpr double kFlankShade = 0.84;
  const Outline& outline = obstacle.points;
  const std::vector<Color> face(outline.size(), shaded(obstacle.color, kFaceShade));
  add_face(outline, kObstacleDepth.near, face, triangles);
  add_face(outline, kObstacleDepth.far, face, triangles);
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const PlanePoint& a = outline[i];
    const PlanePoint& b = outline[(i + 1) % outline.size()];
    const bool is_flat = std::abs(b[1] - a[1]) < std::abs(b[0] - a[0]);
    const Color color = shaded(obstacle.color, is_flat ? 1.0 : kFlankShade);
    add_wall(a, b, kObstacleDepth, color, color, triangles);
    for (const double y : {kObstacleDepth.near, kObstacleDepth.far}) {
      add_line(to_point(a, y), to_point(b, y), kOutlineColor, lines);
    }
    add_line(to_point(a, kObstacleDepth.near), to_point(a, kObstacleDepth.far), kOutlineColor,
             lines);
  }
}

/// Adds a round cloud: dense inside, transparent at its rim, thinner towards its bottom.
void add_cloud(const ScenePolygon& cloud, double y, Drawing& triangles) {
  constexpr int kRounds = 3;
  constexpr double kCore = 0.7;  // of the size
  constexpr double kTopAlpha = 0.95;
  constexpr double kBottomAlpha = 0.45;
  const Outline rim = rounded(cloud.points, kRounds);
  const Outline core =
      around_center(rim, [](double own, double center) { return center + kCore * (own - center); });
  const auto [low, high] =
      std::minmax_element(core.begin(), core.end(),
                          [](const PlanePoint& a, const PlanePoint& b) { return a[1] < b[1]; });
  const double bottom = (*low)[1];
  const double height = std::max((*high)[1] - bottom, 1e-9);
  std::vector<Color> colors;
  for (const PlanePoint& point : core) {
    const double share = (point[1] - bottom) / height;
    colors.push_back(with_alpha(cloud.color, kBottomAlpha + (kTopAlpha - kBottomAlpha) * share));
  }
  add_face(core, y, colors, triangles);
  const Color gone = with_alpha(cloud.color, 0);
  for (std::size_t i = 0; i < rim.size(); ++i) {
    const std::size_t next = (i + 1) % rim.size();
    add_face({core[i], core[next], rim[next], rim[i]}, y, {colors[i], colors[next], gone, gone},
             triangles);
  }
}

Drawing clouds_drawing(const Scene& scene) {
  constexpr std::size_t kRows = 3;
  Drawing drawing{"clouds"};
  for (std::size_t i = 0; i < scene.clouds.size(); ++i) {
    const double y = kNearestCloudY + kCloudSpacing * static_cast<double>(i % kRows);
    if (is_drawable(scene.clouds[i].points)) add_cloud(scene.clouds[i], y, drawing);
  }
  return drawing;
}

void add_flag(const Flag& flag, Drawing& triangles, Drawing& poles) {
  // Gymnasium's proportions, relative to the pole's height.
  constexpr double kPennantLength = 0.5;
  constexpr double kPennantHeight = 0.2;
  constexpr double kTipShade = 0.85;
  const double top = flag.z + flag.height;
  add_line(to_point({flag.x, flag.z}, kFlagY), to_point({flag.x, top}, kFlagY), kPoleColor, poles);
  const Outline pennant{
      {flag.x, top},
      {flag.x, top - kPennantHeight * flag.height},
      {flag.x + kPennantLength * flag.height, top - kPennantHeight / 2 * flag.height}};
  add_face(pennant, kFlagY, {flag.color, flag.color, shaded(flag.color, kTipShade)}, triangles);
}

}  // namespace

std::vector<Drawing> scene_drawings(const Scene& scene) {
  Drawing obstacles{"obstacles"};
  Drawing outlines{"obstacle_outlines", Drawing::Kind::lines, kOutlineWidth};
  for (const ScenePolygon& obstacle : scene.obstacles) {
    if (is_drawable(obstacle.points)) add_obstacle(obstacle, obstacles, outlines);
  }
  Drawing flags{"flags"};
  Drawing poles{"flag_poles", Drawing::Kind::lines, kPoleWidth};
  for (const Flag& flag : scene.flags) {
    if (is_finite({flag.x, flag.z}) && std::isfinite(flag.height)) add_flag(flag, flags, poles);
  }
  return {ground_drawing(scene), obstacles, outlines, clouds_drawing(scene), flags, poles};
}

}  // namespace walker
