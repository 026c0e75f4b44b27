#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "server/markers/markers.h"

namespace walker {
namespace {

// rviz draws coloured vertices unlit, so every shade is chosen here.

/// A point of the world's x,z plane [m].
using PlanePoint = std::array<double, 2>;
/// A closed polygon in the world's x,z plane.
using Outline = std::vector<PlanePoint>;

/// An interval of y, from the viewer's side to the far side.
struct Depth {
  double near;  ///< y [m]
  double far;   ///< y [m], greater than `near`
};

geometry_msgs::Point to_point(const PlanePoint& point, double y) {
  geometry_msgs::Point message;
  message.x = point[0];
  message.y = y;
  message.z = point[1];
  return message;
}

Color shaded(const Color& color, double factor) {
  return {std::min(1.0, color[0] * factor), std::min(1.0, color[1] * factor),
          std::min(1.0, color[2] * factor), color[3]};
}

Color with_alpha(const Color& color, double alpha) { return {color[0], color[1], color[2], alpha}; }

bool is_finite(const PlanePoint& point) {
  return std::isfinite(point[0]) && std::isfinite(point[1]);
}

bool is_drawable(const Outline& outline) {
  constexpr std::size_t kTriangle = 3;
  return outline.size() >= kTriangle && std::all_of(outline.begin(), outline.end(), is_finite);
}

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

void add_line(const geometry_msgs::Point& from, const geometry_msgs::Point& to, const Color& color,
              Marker& lines) {
  lines.points.push_back(from);
  lines.points.push_back(to);
  lines.colors.insert(lines.colors.end(), 2, to_color(color));
}

void add_triangle(const std::array<geometry_msgs::Point, 3>& corners,
                  const std::array<Color, 3>& colors, Marker& triangles) {
  for (std::size_t i = 0; i < corners.size(); ++i) {
    triangles.points.push_back(corners[i]);
    triangles.colors.push_back(to_color(colors[i]));
  }
}

/// Adds the rectangle that the line from `from` to `to` sweeps over the depth.
void add_wall(const PlanePoint& from, const PlanePoint& to, const Depth& depth,
              const Color& near_color, const Color& far_color, Marker& triangles) {
  add_triangle({to_point(from, depth.near), to_point(to, depth.near), to_point(to, depth.far)},
               {near_color, near_color, far_color}, triangles);
  add_triangle({to_point(from, depth.near), to_point(to, depth.far), to_point(from, depth.far)},
               {near_color, far_color, far_color}, triangles);
}

/// Adds a convex polygon at `y`, with one colour per point.
void add_face(const Outline& outline, double y, const std::vector<Color>& colors,
              Marker& triangles) {
  for (std::size_t i = 1; i + 1 < outline.size(); ++i) {
    add_triangle({to_point(outline[0], y), to_point(outline[i], y), to_point(outline[i + 1], y)},
                 {colors[0], colors[i], colors[i + 1]}, triangles);
  }
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
void add_earth(const Outline& outline, const Color& color, Marker& triangles) {
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
               const std::vector<ScenePolygon>& obstacles, Marker& triangles) {
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

Marker ground_marker(const Scene& scene, const Header& header) {
  constexpr double kEndShade = 0.8;
  Marker marker = make_marker(header, "ground", Marker::TRIANGLE_LIST);
  for (std::size_t i = 0; i < scene.ground.size(); ++i) {
    const auto& [outline, color] = scene.ground[i];
    if (!is_drawable(outline)) continue;
    add_earth(outline, color, marker);
    const bool has_surface = i < scene.surface_colors.size();
    add_grass(outline[0], outline[1], has_surface ? scene.surface_colors[i] : color,
              scene.obstacles, marker);
    // Faces at both ends of the ground; those between its pieces are hidden.
    const Color end_color = shaded(color, kEndShade);
    if (i == 0) {
      add_wall(outline[0], outline.back(), kGroundDepth, end_color, end_color, marker);
    }
    if (i + 1 == scene.ground.size()) {
      add_wall(outline[1], outline[2], kGroundDepth, end_color, end_color, marker);
    }
  }
  return marker;
}

void add_obstacle(const ScenePolygon& obstacle, Marker& triangles, Marker& lines) {
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
void add_cloud(const ScenePolygon& cloud, double y, Marker& triangles) {
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

Marker cloud_marker(const Scene& scene, const Header& header) {
  constexpr std::size_t kRows = 3;
  Marker marker = make_marker(header, "clouds", Marker::TRIANGLE_LIST);
  for (std::size_t i = 0; i < scene.clouds.size(); ++i) {
    const double y = kNearestCloudY + kCloudSpacing * static_cast<double>(i % kRows);
    if (is_drawable(scene.clouds[i].points)) add_cloud(scene.clouds[i], y, marker);
  }
  return marker;
}

void add_flag(const Flag& flag, Marker& triangles, Marker& poles) {
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

/// Interpolates between two colours, `share` in [0, 1].
Color mixed(const Color& from, const Color& to, double share) {
  Color color{};
  for (std::size_t i = 0; i < color.size(); ++i) color[i] = from[i] + share * (to[i] - from[i]);
  return color;
}

/// Appends a marker unless it has no points, which rviz reports as an error.
void append_if_any(const Marker& marker, MarkerArray& array) {
  if (!marker.points.empty()) array.markers.push_back(marker);
}

}  // namespace

double floor_center(const Floor& floor, double x) {
  // An even number of tiles, so that the colours do not depend on the centre.
  const double step = 4 * floor.tile;
  return step * std::round(x / step);
}

Marker floor_marker(const Floor& floor, double center, const Header& header) {
  // Extent in tiles: beyond both sides of the picture, and as deep as looks good.
  constexpr int kAhead = 20;
  constexpr int kNear = -7;
  constexpr int kFar = 13;
  constexpr double kPaleness = 0.85;  // of the farthest tiles, against flicker
  const auto& [light, dark] = floor.colors;
  Marker marker = make_marker(header, "floor", Marker::TRIANGLE_LIST);
  if (!std::isfinite(floor.z)) return deletion(header, "floor");
  for (int row = kNear; row < kFar; ++row) {
    const double paleness = kPaleness * std::max(row, 0) / kFar;
    const Depth depth{row * floor.tile, (row + 1) * floor.tile};
    for (int column = -kAhead; column < kAhead; ++column) {
      const Color& tone = (row + column) % 2 == 0 ? light : dark;
      const Color color = mixed(tone, light, paleness);
      const double left = center + column * floor.tile;
      add_wall({left, floor.z}, {left + floor.tile, floor.z}, depth, color, color, marker);
    }
  }
  return marker;
}

MarkerArray scene_markers(const Scene& scene, const Header& header) {
  MarkerArray array;
  array.markers.push_back(deletion(header, ""));
  array.markers.back().action = Marker::DELETEALL;
  append_if_any(ground_marker(scene, header), array);
  Marker obstacles = make_marker(header, "obstacles", Marker::TRIANGLE_LIST);
  Marker outlines = make_marker(header, "obstacle_outlines", Marker::LINE_LIST, kOutlineWidth);
  for (const ScenePolygon& obstacle : scene.obstacles) {
    if (is_drawable(obstacle.points)) add_obstacle(obstacle, obstacles, outlines);
  }
  append_if_any(obstacles, array);
  append_if_any(outlines, array);
  append_if_any(cloud_marker(scene, header), array);
  Marker flags = make_marker(header, "flags", Marker::TRIANGLE_LIST);
  Marker poles = make_marker(header, "flag_poles", Marker::LINE_LIST, kPoleWidth);
  for (const Flag& flag : scene.flags) {
    if (is_finite({flag.x, flag.z}) && std::isfinite(flag.height)) add_flag(flag, flags, poles);
  }
  append_if_any(flags, array);
  append_if_any(poles, array);
  return array;
}

}  // namespace walker
