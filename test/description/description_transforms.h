// Compares a server's transforms with a robot description at given joint angles.
#pragma once

#include <gtest/gtest.h>
#include <urdf/model.h>

#include <map>
#include <string>
#include <tuple>
#include <vector>

#include <tf2_msgs/TFMessage.h>

#include "description/urdf_geometry.h"

namespace walker {

inline std::vector<geometry_msgs::TransformStamped> transforms_to(
    const std::string& frame, const tf2_msgs::TFMessage& message) {
  std::vector<geometry_msgs::TransformStamped> found;
  for (const auto& transform : message.transforms) {
    if (transform.child_frame_id == frame) found.push_back(transform);
  }
  return found;
}

inline urdf::Pose to_urdf(const geometry_msgs::Transform& transform) {
  const auto& [translation, rotation] = std::tie(transform.translation, transform.rotation);
  urdf::Pose pose;
  pose.position = urdf::Vector3(translation.x, translation.y, translation.z);
  pose.rotation = to_urdf(Quaternion{rotation.x, rotation.y, rotation.z, rotation.w});
  return pose;
}

/// Expects one transform per link except the root, from its parent in the description: in
/// `constants` for a fixed joint, in `state` for any other.
/// @param tf_prefix prefix with a trailing slash
inline void expect_the_tree_of(const urdf::Model& model, const std::string& tf_prefix,
                               const tf2_msgs::TFMessage& state,
                               const tf2_msgs::TFMessage& constants) {
  for (const auto& [name, joint] : model.joints_) {
    const bool is_fixed = joint->type == urdf::Joint::FIXED;
    const std::string child = tf_prefix + joint->child_link_name;
    EXPECT_EQ(transforms_to(child, is_fixed ? state : constants).size(), 0U) << child;
    const auto found = transforms_to(child, is_fixed ? constants : state);
    ASSERT_EQ(found.size(), 1U) << child;
    EXPECT_EQ(found[0].header.frame_id, tf_prefix + joint->parent_link_name) << child;
  }
}

inline void expect_the_kinematics_of(const urdf::Model& model, const std::string& tf_prefix,
                                     const std::map<std::string, double>& angles,
                                     const tf2_msgs::TFMessage& state,
                                     const tf2_msgs::TFMessage& constants, double tolerance) {
  expect_the_tree_of(model, tf_prefix, state, constants);
  if (testing::Test::HasFatalFailure()) return;
  for (const auto& [name, joint] : model.joints_) {
    const std::string child = tf_prefix + joint->child_link_name;
    const bool is_fixed = joint->type == urdf::Joint::FIXED;
    urdf::Pose expected = joint->parent_to_joint_origin_transform;
    if (!is_fixed) {
      ASSERT_EQ(angles.count(name), 1U) << name;
      const Vector3 axis{joint->axis.x, joint->axis.y, joint->axis.z};
      expected = compose(expected, about(axis, angles.at(name)));
    }
    const auto found = transforms_to(child, is_fixed ? constants : state);
    expect_same_pose(expected, to_urdf(found[0].transform), tolerance, child);
  }
}

}  // namespace walker
