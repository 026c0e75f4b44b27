// Compares our rotations with those of urdfdom.
#include "description/poses.h"

#include <gtest/gtest.h>
#include <urdf_model/pose.h>

#include <cmath>
#include <random>

namespace walker {
namespace {

constexpr double kTolerance = 1e-14;

urdf::Rotation to_urdf(const Quaternion& q) {
  urdf::Rotation rotation;
  rotation.setFromQuaternion(q[0], q[1], q[2], q[3]);
  return rotation;
}

/// Expects both to rotate the axes alike; the quaternions' signs may differ.
template <typename Rotation>
void expect_same_rotation(const Rotation& expected, const urdf::Rotation& actual) {
  for (const Vector3& axis : {Vector3{1, 0, 0}, Vector3{0, 1, 0}, Vector3{0, 0, 1}}) {
    const Eigen::Vector3d turned = expected * to_eigen(axis);
    const urdf::Vector3 other = actual * urdf::Vector3(axis[0], axis[1], axis[2]);
    EXPECT_NEAR(turned.x(), other.x, kTolerance);
    EXPECT_NEAR(turned.y(), other.y, kTolerance);
    EXPECT_NEAR(turned.z(), other.z, kTolerance);
  }
}

class Rotations : public testing::Test {
 protected:
  Quaternion draw() {
    Quaternion q{normal_(draws_), normal_(draws_), normal_(draws_), normal_(draws_)};
    const double norm = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    for (double& value : q) value /= norm;
    return q;
  }

  std::mt19937 draws_{1};
  std::normal_distribution<double> normal_;
};

TEST_F(Rotations, MultiplyAndRotateAsUrdfdomsDo) {
  for (int i = 0; i < 100; ++i) {
    const Quaternion a = draw();
    const Quaternion b = draw();
    expect_same_rotation(to_eigen(a), to_urdf(a));
    expect_same_rotation(to_eigen(a) * to_eigen(b), to_urdf(a) * to_urdf(b));
    expect_same_rotation(to_eigen(a).conjugate(), to_urdf(a).GetInverse());
  }
}

TEST_F(Rotations, RollPitchYawReadsBackAsTheSameRotation) {
  const double quarter = std::sqrt(0.5);
  std::vector<Quaternion> rotations{{0, 0, 0, 1},
                                    {0, 0, 1, 0},
                                    {0, quarter, 0, quarter},
                                    {0, -quarter, 0, quarter},
                                    {-0.5, -0.5, -0.5, 0.5},
                                    {0.5, -0.5, 0.5, 0.5}};
  for (int i = 0; i < 100; ++i) rotations.push_back(draw());
  for (const Quaternion& q : rotations) {
    const Vector3 angles = roll_pitch_yaw(q);
    urdf::Rotation read;
    read.setFromRPY(angles[0], angles[1], angles[2]);
    expect_same_rotation(to_eigen(q), read);
  }
}

TEST_F(Rotations, AQuarterTurnOfPitchHasNoYaw) {
  const double quarter = std::sqrt(0.5);
  EXPECT_EQ(roll_pitch_yaw({0, -quarter, 0, quarter})[2], 0);
  EXPECT_EQ(roll_pitch_yaw({-0.5, -0.5, -0.5, 0.5})[2], 0);
}

TEST_F(Rotations, ComposeGoesOnFromTheBaseAndRelativeIsTheWayFromIt) {
  for (int i = 0; i < 100; ++i) {
    const Pose base{{1, 2, 3}, draw()};
    const Pose step{{-0.5, 0.25, 4}, draw()};
    const Eigen::Isometry3d pose = to_eigen(base) * to_eigen(step);
    const urdf::Vector3 turned =
        to_urdf(base.orientation) *
        urdf::Vector3(step.position[0], step.position[1], step.position[2]);
    EXPECT_NEAR(pose.translation().x(), base.position[0] + turned.x, kTolerance);
    EXPECT_NEAR(pose.translation().y(), base.position[1] + turned.y, kTolerance);
    EXPECT_NEAR(pose.translation().z(), base.position[2] + turned.z, kTolerance);
    expect_same_rotation(pose.linear(), to_urdf(base.orientation) * to_urdf(step.orientation));
    const Eigen::Isometry3d found = to_eigen(base).inverse() * pose;
    for (int k = 0; k < 3; ++k) {
      EXPECT_NEAR(found.translation()[k], step.position[static_cast<std::size_t>(k)], kTolerance);
    }
    expect_same_rotation(found.linear(), to_urdf(step.orientation));
  }
  EXPECT_TRUE(is_identity(Pose{}));
  EXPECT_FALSE(is_identity({{0, 0, 1e-300}, {0, 0, 0, 1}}));
  EXPECT_FALSE(is_identity({{0, 0, 0}, {0, 1, 0, 0}}));
}

}  // namespace
}  // namespace walker
