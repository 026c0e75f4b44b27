// The specification's poses as Eigen's types.
#pragma once

#include <Eigen/Geometry>

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
/// quarter turn and only a sum of roll and yaw is defined, yaw is 0.
Vector3 roll_pitch_yaw(const Quaternion& quaternion);

}  // namespace walker
