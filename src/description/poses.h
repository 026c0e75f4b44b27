// Conversion of the specification's poses to Eigen types.
#pragma once

#include <Eigen/Geometry>
#include <cmath>

#include "walker_sim/specification.h"

namespace walker {

inline Eigen::Vector3d to_eigen(const Vector3& vector) { return Eigen::Vector3d(vector.data()); }

/// Eigen stores x, y, z, w in this order, too.
inline Eigen::Quaterniond to_eigen(const Quaternion& quaternion) {
  return Eigen::Quaterniond(quaternion.data());
}

/// Transforms coordinates of the frame to those of its reference frame.
inline Eigen::Isometry3d to_eigen(const Pose& pose) {
  return Eigen::Translation3d(to_eigen(pose.position)) * to_eigen(pose.orientation);
}

/// Whether the pose is exactly the identity.
inline bool is_identity(const Pose& pose) {
  return to_eigen(pose).matrix() == Eigen::Matrix4d::Identity();
}

/// URDF's angles: rotations about the fixed x, y and z axes, in this order [rad]. In gimbal lock,
/// where only a sum of roll and yaw is defined, yaw is 0. Eigen's eulerAngles is not suitable: it
/// returns turns by pi and back for small negative angles.
inline Vector3 roll_pitch_yaw(const Quaternion& quaternion) {
  const Eigen::Matrix3d axes = to_eigen(quaternion).toRotationMatrix();  // as columns
  const double cosine = std::hypot(axes(0, 0), axes(1, 0));              // of the pitch
  const double pitch = std::atan2(-axes(2, 0), cosine);
  constexpr double kLock = 1e-12;  // below it, roll and yaw would be rounding errors
  if (cosine < kLock) return {std::atan2(-axes(1, 2), axes(1, 1)), pitch, 0};
  return {std::atan2(axes(2, 1), axes(2, 2)), pitch, std::atan2(axes(1, 0), axes(0, 0))};
}

}  // namespace walker
