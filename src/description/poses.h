// The specification's poses as Eigen's types.
#pragma once

#include <Eigen/Geometry>
#include <cmath>

#include "walker_sim/specification.h"

namespace walker {

inline Eigen::Vector3d to_eigen(const Vector3& vector) { return Eigen::Vector3d(vector.data()); }

/// Eigen, too, keeps x, y, z, w in memory.
inline Eigen::Quaterniond to_eigen(const Quaternion& quaternion) {
  return Eigen::Quaterniond(quaternion.data());
}

/// From the frame's coordinates to those of the frame that it is given in.
inline Eigen::Isometry3d to_eigen(const Pose& pose) {
  return Eigen::Translation3d(to_eigen(pose.position)) * to_eigen(pose.orientation);
}

/// Whether the pose moves nothing at all.
inline bool is_identity(const Pose& pose) {
  return to_eigen(pose).matrix() == Eigen::Matrix4d::Identity();
}

/// URDF's angles: turns about the fixed x, y and z axes, in this order [rad]. Where pitch is a
/// quarter turn and only a sum of roll and yaw is defined, yaw is 0. Eigen's eulerAngles turn by pi
/// and back where an angle is negative.
inline Vector3 roll_pitch_yaw(const Quaternion& quaternion) {
  const Eigen::Matrix3d axes = to_eigen(quaternion).toRotationMatrix();  // the turned ones
  const double cosine = std::hypot(axes(0, 0), axes(1, 0));              // of the pitch
  const double pitch = std::atan2(-axes(2, 0), cosine);
  constexpr double kLock = 1e-12;  // below it, roll and yaw would be made of rounding errors
  if (cosine < kLock) return {std::atan2(-axes(1, 2), axes(1, 1)), pitch, 0};
  return {std::atan2(axes(2, 1), axes(2, 2)), pitch, std::atan2(axes(1, 0), axes(0, 0))};
}

}  // namespace walker
