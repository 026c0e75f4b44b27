#include "robots/bipedal_walker/lidar.h"

#include <algorithm>
#include <cmath>

#include "robots/bipedal_walker/physics.h"

namespace walker::bipedal_walker {
namespace {

/// The rays as vectors: forward, down [m]. Computed by the C library's sine, as in Gymnasium.
const std::array<std::array<double, 2>, kLidarRays>& rays() {
  static const std::array<std::array<double, 2>, kLidarRays> kRays = [] {
    std::array<std::array<double, 2>, kLidarRays> vectors{};
    for (int i = 0; i < kLidarRays; ++i) {
      const double angle = 1.5 * i / 10.0;
      vectors[static_cast<std::size_t>(i)] = {std::sin(angle) * kLidarRange,
                                              std::cos(angle) * kLidarRange};
    }
    return vectors;
  }();
  return kRays;
}

using RayEnds = std::array<b2Vec2, kLidarRays>;

/// Far above the rounding errors of ground and rays [m].
constexpr auto kMargin = static_cast<float>(kTerrainStep);

b2Vec2 to_vector(const Point& point) {
  return {static_cast<float>(point.x), static_cast<float>(point.y)};
}

void keep_nearest(float fraction, RayHit& ray) {
  if (fraction <= ray.fraction) ray = {fraction, true};
}

/// Intersects the edge's line, normal.q = normal.from, with each ray, q = origin + t d. Performs
/// the operations of b2EdgeShape::RayCast.
void intersect_edge(const b2Vec2& from, const b2Vec2& to, const b2Vec2& origin, const RayEnds& ends,
                    LidarScan& scan) {
  const b2Vec2 edge = to - from;
  const float edge_squared = b2Dot(edge, edge);
  b2Vec2 normal(edge.y, -edge.x);
  normal.Normalize();
  const float numerator = b2Dot(normal, from - origin);
  for (std::size_t i = 0; i < ends.size(); ++i) {
    if (ends[i].x < from.x - kMargin) continue;
    const b2Vec2 direction = ends[i] - origin;
    const float denominator = b2Dot(normal, direction);
    if (denominator == 0) continue;
    const float t = numerator / denominator;
    if (t < 0 || scan[i].fraction < t) continue;
    const b2Vec2 hit = origin + t * direction;
    const float along = b2Dot(hit - from, edge) / edge_squared;
    if (along < 0 || 1 < along) continue;
    keep_nearest(t, scan[i]);
  }
}

void intersect_obstacle(const b2Fixture& obstacle, float left, const b2Vec2& origin,
                        const RayEnds& ends, LidarScan& scan) {
  for (std::size_t i = 0; i < ends.size(); ++i) {
    if (ends[i].x < left - kMargin) continue;
    const b2RayCastInput input{origin, ends[i], scan[i].fraction};
    b2RayCastOutput output;
    if (obstacle.RayCast(&output, input, 0)) keep_nearest(output.fraction, scan[i]);
  }
}

/// Finds the first hit of each ray from `origin` to `ends`, which are in ascending order of x. Does
/// not search the world's tree: the ground is sorted from left to right, so the few pieces that
/// rays can hit are known. The nearest hit does not depend on their order.
void cast_rays(const Physics& physics, const Terrain& terrain, const b2Vec2& origin,
               const RayEnds& ends, LidarScan& scan) {
  // Box2D's own assertion, which fails for rays of zero length and for NaN.
  for (const b2Vec2& end : ends) b2Assert((end - origin).LengthSquared() > 0);
  const float left = origin.x - kMargin;
  const float right = ends.back().x + kMargin;

  const auto edge_below = [&](float x) {
    constexpr double kLastEdge = kTerrainLength - 2;
    const double index = std::floor(double{x} / kTerrainStep);
    return static_cast<std::size_t>(std::clamp(index, 0.0, kLastEdge));
  };
  for (std::size_t i = edge_below(left); i <= edge_below(right); ++i) {
    intersect_edge(to_vector(terrain.ground[i]), to_vector(terrain.ground[i + 1]), origin, ends,
                   scan);
  }
  for (std::size_t i = 0; i < terrain.obstacles.size(); ++i) {
    const std::array<Point, 4>& corners = terrain.obstacles[i];  // left and right first
    if (corners[1].x < double{left} || corners[0].x > double{right}) continue;
    intersect_obstacle(physics.obstacle(i), static_cast<float>(corners[0].x), origin, ends, scan);
  }
}

}  // namespace

void cast_lidar(const Physics& physics, const Terrain& terrain, LidarScan& scan) {
  const b2Vec2 origin = physics.hull().GetPosition();
  RayEnds ends;
  for (std::size_t i = 0; i < ends.size(); ++i) {
    const auto [forward, down] = rays()[i];
    // Summed in double and rounded once, as Gymnasium does.
    ends[i] = b2Vec2(static_cast<float>(double{origin.x} + forward),
                     static_cast<float>(double{origin.y} - down));
  }
  scan = {};
  cast_rays(physics, terrain, origin, ends, scan);
}

}  // namespace walker::bipedal_walker
