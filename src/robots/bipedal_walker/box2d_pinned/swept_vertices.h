// Only for files compiled with -fno-access-control: a body's sweep is private to it.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include <Box2D/Box2D.h>

namespace walker::bipedal_walker {

/// Proves, cheaper than by a time of impact, that a body does not touch ground within a step.
///
/// Bounds the body's vertices during a sweep by their positions at its beginning and end.
/// A vertex moves along x(t) = c(t) + R(a(t)) r, with centre c and angle a linear in t. Along an
/// axis n of length 1, n c(t) is between its values at both ends. The second derivative of n R(a) r
/// by the angle is at most |r|, so n R(a) r is at most |r| (a1 - a0)^2 / 8 below the chord between
/// its ends:
///
///   n x(t) >= min(n x(0), n x(1)) - |r| (a1 - a0)^2 / 8
///
/// If this bound is beyond the ground's shape for every vertex, so is the body at all times.
class SweptVertices {
 public:
  /// Computes the vertices, unless the sweep is unchanged. The body must be at its sweep's end.
  void follow(const b2Body& body) {
    if (is_known_ && is_same(sweep_, body.m_sweep)) return;
    sweep_ = body.m_sweep;
    is_known_ = is_near(sweep_);
    if (!is_known_) return;
    b2Transform begin;
    begin.q.Set(sweep_.a0);
    begin.p = sweep_.c0 - b2Mul(begin.q, sweep_.localCenter);
    const auto& shape = static_cast<const b2PolygonShape&>(*body.m_fixtureList->GetShape());
    float farthest = 0;  // squared
    count_ = 0;
    for (int i = 0; i < shape.m_count; ++i) {
      const b2Vec2& vertex = shape.m_vertices[i];
      vertices_[count_++] = b2Mul(begin, vertex);
      vertices_[count_++] = b2Mul(body.m_xf, vertex);
      farthest = std::max(farthest, b2DistanceSquared(vertex, sweep_.localCenter));
    }
    const float turn = sweep_.a - sweep_.a0;
    bulge_ = std::sqrt(farthest) * turn * turn / 8;
  }

  /// Whether the shapes stay farther apart along one of the tested axes than the distance at which
  /// b2TimeOfImpact reports touching. False if this cannot be proved.
  /// @param ground an edge or a polygon of a static body at the origin
  bool stay_apart_from(const b2Shape& ground) const {
    if (!is_known_) return false;
    const b2Vec2 across(1, 0);
    if (ground.GetType() == b2Shape::e_edge) {
      const auto& edge = static_cast<const b2EdgeShape&>(ground);
      const std::array<b2Vec2, 2> ends{edge.m_vertex1, edge.m_vertex2};
      b2Vec2 normal = b2Cross(ends[1] - ends[0], 1.0F);
      normal.Normalize();
      return stay_beyond(ends.data(), 2, normal) || stay_beyond(ends.data(), 2, across);
    }
    if (ground.GetType() != b2Shape::e_polygon) return false;
    const auto& polygon = static_cast<const b2PolygonShape&>(ground);
    const b2Vec2 up(0, 1);
    return stay_beyond(polygon.m_vertices, polygon.m_count, up) ||
           stay_beyond(polygon.m_vertices, polygon.m_count, across);
  }

 private:
  /// Target plus tolerance of b2TimeOfImpact for polygons and edges: nearer shapes touch.
  static constexpr float kTouching = 1.25F * b2_linearSlop;
  static_assert(2 * b2_polygonRadius - 3 * b2_linearSlop < 1.001F * b2_linearSlop);

  /// The rounding error of a vertex is at most 1e-4 m for positions and angles below these limits.
  /// The margin is ten times that, for the errors made here and in Box2D.
  static constexpr float kMargin = 1e-3F;
  static constexpr float kMaxPosition = 500;  // [m]
  static constexpr float kMaxAngle = 100;     // [rad]

  static bool is_same(const b2Sweep& a, const b2Sweep& b) {
    return a.c0 == b.c0 && a.c == b.c && a.a0 == b.a0 && a.a == b.a;
  }

  static bool is_near(const b2Vec2& position) {
    return std::abs(position.x) < kMaxPosition && std::abs(position.y) < kMaxPosition;
  }

  static bool is_near(const b2Sweep& sweep) {
    return is_near(sweep.c0) && is_near(sweep.c) && std::abs(sweep.a0) < kMaxAngle &&
           std::abs(sweep.a) < kMaxAngle;
  }

  struct Range {
    float low, high;
  };

  static Range range_of(const b2Vec2* vertices, int count, const b2Vec2& axis) {
    Range range{b2_maxFloat, -b2_maxFloat};
    for (int i = 0; i < count; ++i) {
      const float position = b2Dot(axis, vertices[i]);
      range = {std::min(range.low, position), std::max(range.high, position)};
    }
    return range;
  }

  bool stay_beyond(const b2Vec2* ground, int count, const b2Vec2& axis) const {
    const Range theirs = range_of(ground, count, axis);
    const Range ours = range_of(vertices_.data(), count_, axis);
    const float distance = kTouching + kMargin + bulge_;
    return ours.low > theirs.high + distance || ours.high < theirs.low - distance;
  }

  b2Sweep sweep_{};
  bool is_known_ = false;
  float bulge_ = 0;  // bound of a vertex's distance beyond its positions at both ends [m]
  int count_ = 0;
  std::array<b2Vec2, std::size_t{2} * b2_maxPolygonVertices>
      vertices_;  // at the beginning and at the end [m]
};

}  // namespace walker::bipedal_walker
