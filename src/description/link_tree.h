// Placement and naming of a specification's links in robot descriptions and viewers, and their
// poses as Eigen types.
#pragma once

#include <Eigen/Geometry>
#include <map>
#include <string>
#include <vector>

#include "walker_sim/specification.h"

namespace walker {

// Depth along y of a planar world's bodies, for display and collision [m]. Masses stay in the plane
// y = 0.
constexpr double kTrunkDepth = 0.4;
constexpr double kLimbDepth = 0.16;

/// Position of a link's prisms along y, and their depth [m].
struct Place {
  double y = 0;
  double depth = 0;
};

/// Returns the places of a planar world's links by name. Branches of the trunk stand beside each
/// other in y, the first on the far side (+y).
/// @throws std::invalid_argument for a joint that is not connected to the trunk
std::map<std::string, Place> place_links(const Specification& specification);

/// Returns the name of the link that each joint turns: its child or, if the child's frame differs
/// from the joint's, `<child>_hinge`, a massless link on which the child is fixed. If that name is
/// taken, `_hinge` is appended again.
std::vector<std::string> turned_links(const Specification& specification);

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
