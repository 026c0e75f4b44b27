// Geometry in the world's x,z plane, independent of the engine's.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "walker_sim/sensors.h"

namespace walker::test {

/// A surface of the ground or an edge of an obstacle.
struct Segment {
  std::array<double, 2> from;
  std::array<double, 2> to;
};

inline std::vector<Segment> surfaces(const Scene& scene) {
  std::vector<Segment> segments;
  segments.reserve(scene.ground.size());
  for (const ScenePolygon& ground : scene.ground) {
    segments.push_back({ground.points[0], ground.points[1]});
  }
  for (const ScenePolygon& obstacle : scene.obstacles) {
    for (std::size_t i = 0; i < obstacle.points.size(); ++i) {
      segments.push_back({obstacle.points[i], obstacle.points[(i + 1) % obstacle.points.size()]});
    }
  }
  return segments;
}

/// Distance from `origin` along the unit vector `direction` to the segment; infinite if the ray
/// misses it.
inline double distance_along(const std::array<double, 2>& origin,
                             const std::array<double, 2>& direction, const Segment& segment) {
  constexpr double kMiss = std::numeric_limits<double>::infinity();
  const double ex = segment.to[0] - segment.from[0];
  const double ez = segment.to[1] - segment.from[1];
  const double dx = segment.from[0] - origin[0];
  const double dz = segment.from[1] - origin[1];
  const double determinant = ex * direction[1] - ez * direction[0];
  if (std::abs(determinant) < 1e-12) return kMiss;
  const double along = (ex * dz - ez * dx) / determinant;
  const double part = (direction[0] * dz - direction[1] * dx) / determinant;
  return along >= 0 && part >= -1e-6 && part <= 1 + 1e-6 ? along : kMiss;
}

inline double distance_to(const std::array<double, 2>& point, const Segment& segment) {
  const double ex = segment.to[0] - segment.from[0];
  const double ez = segment.to[1] - segment.from[1];
  const double length_squared = ex * ex + ez * ez;
  double part = 0;
  if (length_squared > 0) {
    part = ((point[0] - segment.from[0]) * ex + (point[1] - segment.from[1]) * ez) / length_squared;
  }
  part = std::clamp(part, 0.0, 1.0);
  return std::hypot(segment.from[0] + part * ex - point[0], segment.from[1] + part * ez - point[1]);
}

}  // namespace walker::test
