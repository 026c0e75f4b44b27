// Geometry independent of the engines: transforms that tf2 looks up, and the world's x,z plane.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <vector>

#include <geometry_msgs/Point.h>
#include <geometry_msgs/Quaternion.h>
#include <geometry_msgs/Vector3.h>
#include <tf2/LinearMath/Quaternion.h>
#include <tf2/LinearMath/Transform.h>
#include <tf2/buffer_core.h>
#include <tf2_msgs/TFMessage.h>

#include "walker_sim/sensors.h"
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

/// A surface of the ground or an edge of an obstacle.
struct Segment {
  std::array<double, 2> from;
  std::array<double, 2> to;
};

inline std::vector<Segment> surfaces(const Scene& scene) {
  std::vector<Segment> segments;
  segments.reserve(scene.ground.size() + 1);
  constexpr double kFar = 1000;  // [m]
  if (scene.floor) segments.push_back({{-kFar, scene.floor->z}, {kFar, scene.floor->z}});
  for (const ScenePolygon& ground : scene.ground) {
    segments.push_back({ground.points[0], ground.points[1]});
  }
  for (const ScenePolygon& obstacle : scene.obstacles) {
    for (std::size_t i = 0; i < obstacle.points.size(); ++i) {
      segments.push_back({obstacle.points[i], obstacle.points[(i + 1) % obstacle.points.size()]});
    }
  }
  return segments;
}

/// Distance from `origin` along the unit vector `direction` to the segment; infinite if the ray
/// misses it.
inline double distance_along(const std::array<double, 2>& origin,
                             const std::array<double, 2>& direction, const Segment& segment) {
  constexpr double kMiss = std::numeric_limits<double>::infinity();
  const double ex = segment.to[0] - segment.from[0];
  const double ez = segment.to[1] - segment.from[1];
  const double dx = segment.from[0] - origin[0];
  const double dz = segment.from[1] - origin[1];
  const double determinant = ex * direction[1] - ez * direction[0];
  if (std::abs(determinant) < 1e-12) return kMiss;
  const double along = (ex * dz - ez * dx) / determinant;
  const double part = (direction[0] * dz - direction[1] * dx) / determinant;
  return along >= 0 && part >= -1e-6 && part <= 1 + 1e-6 ? along : kMiss;
}

inline double distance_to(const std::array<double, 2>& point, const Segment& segment) {
  const double ex = segment.to[0] - segment.from[0];
  const double ez = segment.to[1] - segment.from[1];
  const double length_squared = ex * ex + ez * ez;
  double part = 0;
  if (length_squared > 0) {
    part = ((point[0] - segment.from[0]) * ex + (point[1] - segment.from[1]) * ez) / length_squared;
  }
  part = std::clamp(part, 0.0, 1.0);
  return std::hypot(segment.from[0] + part * ex - point[0], segment.from[1] + part * ez - point[1]);
}

}  // namespace walker::test
