// Explicit quaternion and pose formulas, independent of the engines whose results they check.
#pragma once

#include <cmath>

#include "walker_sim/specification.h"

namespace walker {

/// Returns the rotation by `angle` [rad] about a unit axis.
inline Quaternion rotation(const Vector3& axis, double angle) {
  const double sine = std::sin(angle / 2);
  return {sine * axis[0], sine * axis[1], sine * axis[2], std::cos(angle / 2)};
}

/// Returns the rotation that applies `inner` first, then `outer`.
inline Quaternion composed(const Quaternion& outer, const Quaternion& inner) {
  const auto& [ax, ay, az, aw] = outer;
  const auto& [bx, by, bz, bw] = inner;
  return {aw * bx + ax * bw + ay * bz - az * by, aw * by - ax * bz + ay * bw + az * bx,
          aw * bz + ax * by - ay * bx + az * bw, aw * bw - ax * bx - ay * by - az * bz};
}

inline Vector3 rotated(const Quaternion& quaternion, const Vector3& vector) {
  const auto& [x, y, z, w] = quaternion;
  const Quaternion turned =
      composed(composed(quaternion, Quaternion{vector[0], vector[1], vector[2], 0}),
               Quaternion{-x, -y, -z, w});
  return {turned[0], turned[1], turned[2]};
}

/// Transforms a point from the frame with this pose to the frame in which the pose is given.
inline Vector3 transformed(const Pose& pose, const Vector3& point) {
  Vector3 result = rotated(pose.orientation, point);
  for (std::size_t k = 0; k < 3; ++k) result[k] += pose.position[k];
  return result;
}

inline Pose composed(const Pose& outer, const Pose& inner) {
  return {transformed(outer, inner.position), composed(outer.orientation, inner.orientation)};
}

/// Returns |a . b|: 1 if two unit quaternions are the same rotation, otherwise less.
inline double alignment(const Quaternion& a, const Quaternion& b) {
  return std::abs(a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]);
}

}  // namespace walker
