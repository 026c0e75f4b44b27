#include "description/poses.h"

#include <cmath>

namespace walker {

Quaternion conjugate(const Quaternion& q) { return {-q[0], -q[1], -q[2], q[3]}; }

Quaternion multiply(const Quaternion& a, const Quaternion& b) {
  return {a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1],
          a[3] * b[1] - a[0] * b[2] + a[1] * b[3] + a[2] * b[0],
          a[3] * b[2] + a[0] * b[1] - a[1] * b[0] + a[2] * b[3],
          a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2]};
}

Vector3 rotate(const Quaternion& q, const Vector3& v) {
  const Quaternion result = multiply(multiply(q, {v[0], v[1], v[2], 0}), conjugate(q));
  return {result[0], result[1], result[2]};
}

Vector3 add(const Vector3& a, const Vector3& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }

Vector3 subtract(const Vector3& a, const Vector3& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

Pose compose(const Pose& base, const Pose& pose) {
  return {add(base.position, rotate(base.orientation, pose.position)),
          multiply(base.orientation, pose.orientation)};
}

Pose relative(const Pose& base, const Pose& pose) {
  const Quaternion inverse = conjugate(base.orientation);
  return {rotate(inverse, subtract(pose.position, base.position)),
          multiply(inverse, pose.orientation)};
}

bool is_identity(const Pose& pose) {
  const Pose identity;
  return pose.position == identity.position && pose.orientation == identity.orientation;
}

Vector3 roll_pitch_yaw(const Quaternion& q) {
  // The turned axes: columns of the rotation matrix.
  const Vector3 x_axis = rotate(q, {1, 0, 0});
  const Vector3 y_axis = rotate(q, {0, 1, 0});
  const Vector3 z_axis = rotate(q, {0, 0, 1});
  const double cosine = std::hypot(x_axis[0], x_axis[1]);  // of the pitch
  const double pitch = std::atan2(-x_axis[2], cosine);
  constexpr double kLock = 1e-12;  // below it, roll and yaw would be made of rounding errors
  if (cosine < kLock) return {std::atan2(-z_axis[1], y_axis[1]), pitch, 0};
  return {std::atan2(y_axis[2], z_axis[2]), pitch, std::atan2(x_axis[1], x_axis[0])};
}

}  // namespace walker
