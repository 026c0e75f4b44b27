// Robot descriptions, read by urdfdom: their frames, and comparisons with specifications and with a
// server's transforms.
#pragma once

#include <gtest/gtest.h>
#include <urdf/model.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <map>
#include <memory>
#include <string>
#include <tuple>
#include <vector>

#include <tf2_msgs/TFMessage.h>

#include "description/link_tree.h"
#include "pose_algebra.h"
#include "walker_sim/registry.h"

namespace walker {

/// Returns the content of a file of the package's source.
inline std::string read_source(const std::string& path) {
  std::ifstream file(WALKER_SIM_SOURCE_DIR "/" + path, std::ios::binary);
  if (!file) ADD_FAILURE() << path << ": cannot be read";
  return {std::istreambuf_iterator<char>(file), {}};
}

/// A committed description, and the environment that it describes.
class CommittedUrdfTest : public testing::Test {
 protected:
  CommittedUrdfTest(const std::string& robot, const std::string& id)
      : environment_(make(id)), text_(read_source("urdf/" + robot + ".urdf")) {}
  void SetUp() override { ASSERT_TRUE(model_.initString(text_)); }

  const Specification& specification() const { return environment_->specification(); }

  std::unique_ptr<Environment> environment_;
  std::string text_;
  urdf::Model model_;
};

inline Pose to_pose(const urdf::Pose& pose) {
  const auto& [position, rotation] = std::tie(pose.position, pose.rotation);
  return {{position.x, position.y, position.z}, {rotation.x, rotation.y, rotation.z, rotation.w}};
}

/// Returns a hinge's frame in its parent's, by the description, with the hinge at `angle`.
inline Pose turned(const urdf::Joint& hinge, double angle) {
  const Vector3 axis{hinge.axis.x, hinge.axis.y, hinge.axis.z};
  return composed(to_pose(hinge.parent_to_joint_origin_transform), {{}, rotation(axis, angle)});
}

/// Compares the origins and the points 1 m along x and y.
inline void expect_same_pose(const Pose& expected, const Pose& actual, double tolerance,
                             const std::string& what) {
  for (const Vector3& point : {Vector3{0, 0, 0}, Vector3{1, 0, 0}, Vector3{0, 1, 0}}) {
    const Vector3 one = transformed(expected, point);
    const Vector3 other = transformed(actual, point);
    for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(one[k], other[k], tolerance) << what;
  }
}

/// Returns the child's frame in the parent's, by the description, with the joint at `angle`.
inline Pose pose_of_child(const urdf::Model& model, const Joint& joint, double angle) {
  const urdf::JointConstSharedPtr hinge = model.getJoint(joint.name);
  if (hinge->child_link_name == joint.child) return turned(*hinge, angle);
  const urdf::JointConstSharedPtr mount = model.getLink(joint.child)->parent_joint;
  EXPECT_EQ(mount->type, urdf::Joint::FIXED);
  EXPECT_EQ(mount->parent_link_name, hinge->child_link_name);
  EXPECT_EQ(hinge->child_link_name, joint.child + "_hinge");
  EXPECT_FALSE(model.getLink(hinge->child_link_name)->inertial);
  return composed(turned(*hinge, angle), to_pose(mount->parent_to_joint_origin_transform));
}

/// Returns a description without the comment before it, which names the environment.
inline std::string without_comment(const std::string& urdf) {
  return urdf.substr(urdf.find("-->"));
}

/// Compares numbers up to a share of the expected one; 0: exactly.
inline void expect_near(double expected, double actual, double tolerance, const std::string& what) {
  EXPECT_NEAR(actual, expected, tolerance * std::abs(expected)) << what;
}

inline void expect_near(const Vector3& expected, const urdf::Vector3& actual, double tolerance,
                        const std::string& what) {
  expect_near(expected[0], actual.x, tolerance, what + " x");
  expect_near(expected[1], actual.y, tolerance, what + " y");
  expect_near(expected[2], actual.z, tolerance, what + " z");
}

/// Expects the masses, and the moments of inertia that the specification has.
inline void expect_masses(const Specification& specification, const urdf::Model& model,
                          double tolerance) {
  for (const Link& link : specification.links) {
    const urdf::LinkConstSharedPtr found = model.getLink(link.name);
    ASSERT_TRUE(found && found->inertial) << link.name;
    const urdf::Inertial& body = *found->inertial;
    expect_near(link.mass, body.mass, tolerance, link.name + " mass");
    expect_near(link.center_of_mass, body.origin.position, tolerance, link.name + " centre");
    EXPECT_EQ(body.origin.rotation.w, 1) << link.name << ": the moments are along the link's axes";
    expect_near(link.inertia.yy, body.iyy, tolerance, link.name + " iyy");
    if (std::isnan(link.inertia.xx)) continue;
    expect_near({link.inertia.xx, link.inertia.xy, link.inertia.xz}, {body.ixx, body.ixy, body.ixz},
                tolerance, link.name + " inertia, x with");
    expect_near(link.inertia.yz, body.iyz, tolerance, link.name + " iyz");
    expect_near(link.inertia.zz, body.izz, tolerance, link.name + " izz");
  }
}

/// Expects the joints. Their children may be on massless links.
inline void expect_joints(const Specification& specification, const urdf::Model& model,
                          double tolerance) {
  for (const Joint& joint : specification.joints) {
    const urdf::JointConstSharedPtr found = model.getJoint(joint.name);
    ASSERT_TRUE(found && found->limits) << joint.name;
    EXPECT_EQ(found->parent_link_name, joint.parent);
    expect_near(joint.origin, found->parent_to_joint_origin_transform.position, tolerance,
                joint.name);
    EXPECT_EQ(found->parent_to_joint_origin_transform.rotation.w, 1) << joint.name;
    expect_near(joint.axis, found->axis, 0, joint.name + " axis");
    EXPECT_EQ(found->limits->effort, joint.maximum_effort);
    if (std::isfinite(joint.lower)) {
      EXPECT_EQ(found->type, urdf::Joint::REVOLUTE) << joint.name;
      expect_near(joint.lower, found->limits->lower, tolerance, joint.name + " lower");
      expect_near(joint.upper, found->limits->upper, tolerance, joint.name + " upper");
    } else {
      EXPECT_EQ(found->type, urdf::Joint::CONTINUOUS) << joint.name;
    }
  }
}

inline std::vector<geometry_msgs::TransformStamped> transforms_to(
    const std::string& frame, const tf2_msgs::TFMessage& message) {
  std::vector<geometry_msgs::TransformStamped> found;
  for (const auto& transform : message.transforms) {
    if (transform.child_frame_id == frame) found.push_back(transform);
  }
  return found;
}

inline Pose to_pose(const geometry_msgs::Transform& transform) {
  const auto& [translation, rotation] = std::tie(transform.translation, transform.rotation);
  return {{translation.x, translation.y, translation.z},
          {rotation.x, rotation.y, rotation.z, rotation.w}};
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
    ASSERT_EQ(angles.count(name), is_fixed ? 0U : 1U) << name;
    const Pose expected = is_fixed ? to_pose(joint->parent_to_joint_origin_transform)
                                   : turned(*joint, angles.at(name));
    const auto found = transforms_to(child, is_fixed ? constants : state);
    expect_same_pose(expected, to_pose(found[0].transform), tolerance, child);
  }
}

}  // namespace walker
