// Frames and joints of a robot description, computed with urdfdom's rotations.
#pragma once

#include <gtest/gtest.h>
#include <urdf/model.h>

#include <cmath>
#include <string>

#include "walker_sim/specification.h"

namespace walker {

inline urdf::Rotation to_urdf(const Quaternion& q) {
  urdf::Rotation rotation;
  rotation.setFromQuaternion(q[0], q[1], q[2], q[3]);
  return rotation;
}

inline urdf::Vector3 to_urdf(const Vector3& v) { return {v[0], v[1], v[2]}; }

/// Returns outer * inner: transforms `inner` from the frame `outer` to the frame of `outer`.
inline urdf::Pose compose(const urdf::Pose& outer, const urdf::Pose& inner) {
  urdf::Pose pose;
  const urdf::Vector3 turned = outer.rotation * inner.position;
  pose.position = urdf::Vector3(outer.position.x + turned.x, outer.position.y + turned.y,
                                outer.position.z + turned.z);
  pose.rotation = outer.rotation * inner.rotation;
  return pose;
}

inline urdf::Pose about(const Vector3& axis, double angle) {
  const double s = std::sin(angle / 2);
  urdf::Pose pose;
  pose.rotation = to_urdf(Quaternion{s * axis[0], s * axis[1], s * axis[2], std::cos(angle / 2)});
  return pose;
}

/// Compares the origins and the points 1 m along x and y.
inline void expect_same_pose(const urdf::Pose& expected, const urdf::Pose& actual, double tolerance,
                             const std::string& what) {
  for (const Vector3& point : {Vector3{0, 0, 0}, Vector3{1, 0, 0}, Vector3{0, 1, 0}}) {
    urdf::Pose inner;
    inner.position = to_urdf(point);
    const urdf::Vector3 one = compose(expected, inner).position;
    const urdf::Vector3 other = compose(actual, inner).position;
    EXPECT_NEAR(one.x, other.x, tolerance) << what;
    EXPECT_NEAR(one.y, other.y, tolerance) << what;
    EXPECT_NEAR(one.z, other.z, tolerance) << what;
  }
}

/// Returns the child's frame in the parent's, by the description, with the joint at `angle`.
inline urdf::Pose pose_of_child(const urdf::Model& model, const Joint& joint, double angle) {
  const urdf::JointConstSharedPtr hinge = model.getJoint(joint.name);
  const urdf::Pose turned = compose(hinge->parent_to_joint_origin_transform,
                                    about({hinge->axis.x, hinge->axis.y, hinge->axis.z}, angle));
  if (hinge->child_link_name == joint.child) return turned;
  const urdf::JointConstSharedPtr mount = model.getLink(joint.child)->parent_joint;
  EXPECT_EQ(mount->type, urdf::Joint::FIXED);
  EXPECT_EQ(mount->parent_link_name, hinge->child_link_name);
  EXPECT_EQ(hinge->child_link_name, joint.child + "_hinge");
  EXPECT_FALSE(model.getLink(hinge->child_link_name)->inertial);
  return compose(turned, mount->parent_to_joint_origin_transform);
}

}  // namespace walker
