// Proves, cheaper than by a time of impact, that a body does not touch terrain within a step.
#pragma once

#include <array>
#include <cstddef>

#include <Box2D/Box2D.h>

namespace walker::bipedal_walker {

/// Bounds a body's vertices during a sweep by their positions at its beginning and end.
///
/// A vertex moves along x(t) = c(t) + R(a(t)) r, with centre c and angle a linear in t. Along an
/// axis n of length 1, n c(t) is between its values at both ends. The second derivative of n R(a) r
/// by the angle is at most |r|, so n R(a) r is at most |r| (a1 - a0)^2 / 8 below the chord between
/// its ends:
///
///   n x(t) >= min(n x(0), n x(1)) - |r| (a1 - a0)^2 / 8
///
/// If this bound is beyond the terrain's shape for every vertex, so is the body at all times.
class SweptVertices {
 public:
  /// Computes the vertices, unless the sweep is unchanged. The body must be at its sweep's end.
  void follow(const b2Body& body);

  /// Whether the shapes stay farther apart along one of the tested axes than the distance at which
  /// b2TimeOfImpact reports touching. False if this cannot be proved.
  /// @param terrain an edge or a polygon of a static body at the origin
  bool stay_apart_from(const b2Shape& terrain) const;

 private:
  bool stay_beyond(const b2Vec2* terrain, int count, const b2Vec2& axis) const;

  b2Sweep sweep_{};
  bool is_known_ = false;
  float bulge_ = 0;  // bound of a vertex's distance beyond its positions at both ends [m]
  int count_ = 0;
  std::array<b2Vec2, std::size_t{2} * b2_maxPolygonVertices>
      vertices_;  // at the beginning and at the end [m]
};

}  // namespace walker::bipedal_walker
