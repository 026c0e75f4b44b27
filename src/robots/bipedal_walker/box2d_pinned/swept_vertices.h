// A proof that a moving body does not meet a piece of terrain within a step, which is cheaper than
// the time at which it does.
#pragma once

#include <array>
#include <cstddef>

#include <Box2D/Box2D.h>

namespace walker::bipedal_walker {

/// A body's vertices where a sweep begins and where it ends, from which follows where they are not
/// in between.
///
/// A vertex moves along x(t) = c(t) + R(a(t)) r, centre and angle linearly in t. Along an axis n of
/// length 1, n c(t) is between its values at both ends, and n R(a) r, whose second derivative by
/// the angle is |r| at most, is below the chord between its ends by |r| (a1 - a0)^2 / 8 at most. So
///
///   n x(t) >= min(n x(0), n x(1)) - |r| (a1 - a0)^2 / 8
///
/// and where this is beyond all of a terrain's shape for each vertex, so is the body, at all times.
class SweptVertices {
 public:
  /// Of the body as it is: at the end of its sweep. The same again costs nothing.
  void follow(const b2Body& body);

  /// Whether b2TimeOfImpact cannot find the shapes touching: along one of some axes they stay
  /// further apart than where it takes them to touch. False where this is not known.
  /// @param terrain an edge or a polygon of a static body at the origin
  bool stay_apart_from(const b2Shape& terrain) const;

 private:
  bool stay_beyond(const b2Vec2* terrain, int count, const b2Vec2& axis) const;

  b2Sweep sweep_{};
  bool is_known_ = false;
  float bulge_ = 0;  // how far a vertex may be beyond where it is at both ends [m]
  int count_ = 0;
  std::array<b2Vec2, std::size_t{2} * b2_maxPolygonVertices>
      vertices_;  // at the beginning and at the end [m]
};

}  // namespace walker::bipedal_walker
