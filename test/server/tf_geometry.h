// Conversions to tf2's types, and transforms that tf2 looks up.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include <geometry_msgs/Point.h>
#include <geometry_msgs/Quaternion.h>
#include <geometry_msgs/Vector3.h>
#include <tf2/LinearMath/Quaternion.h>
#include <tf2/LinearMath/Transform.h>
#include <tf2/buffer_core.h>
#include <tf2_msgs/TFMessage.h>

#include "walker_sim/specification.h"

namespace walker::test {

inline tf2::Vector3 to_tf(const geometry_msgs::Vector3& v) { return {v.x, v.y, v.z}; }
inline tf2::Vector3 to_tf(const geometry_msgs::Point& p) { return {p.x, p.y, p.z}; }
inline tf2::Vector3 to_tf(const Vector3& v) { return {v[0], v[1], v[2]}; }
inline tf2::Quaternion to_tf(const geometry_msgs::Quaternion& q) { return {q.x, q.y, q.z, q.w}; }
inline tf2::Quaternion to_tf(const Quaternion& q) { return {q[0], q[1], q[2], q[3]}; }

/// Rotation by `angle` [rad] about -y, the axis of the walkers' joints.
inline tf2::Quaternion about_minus_y(double angle) { return {tf2::Vector3(0, -1, 0), angle}; }

/// Angle between two rotations [rad]; q and -q are the same rotation.
inline double angle_between(const tf2::Quaternion& a, const tf2::Quaternion& b) {
  const tf2::Quaternion turn = a.inverse() * b;
  return 2 * std::asin(std::min(1.0, tf2::Vector3(turn.x(), turn.y(), turn.z()).length()));
}

/// Pose of `child` in `parent`, computed by tf2.
/// @param transforms with equal stamps
/// @param fixed      from /tf_static
inline tf2::Transform look_up(const tf2_msgs::TFMessage& transforms, const std::string& parent,
                              const std::string& child, const tf2_msgs::TFMessage& fixed = {}) {
  tf2::BufferCore buffer;
  for (const auto& transform : transforms.transforms) {
    EXPECT_TRUE(buffer.setTransform(transform, "test"));
  }
  for (const auto& transform : fixed.transforms) {
    EXPECT_TRUE(buffer.setTransform(transform, "test", true));
  }
  const geometry_msgs::Transform found =
      buffer.lookupTransform(parent, child, transforms.transforms.front().header.stamp).transform;
  return tf2::Transform(to_tf(found.rotation), to_tf(found.translation));
}

}  // namespace walker::test
