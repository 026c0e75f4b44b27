// Compares our rotations with those of urdfdom.
#include "description/link_tree.h"

#include <gtest/gtest.h>
#include <urdf_model/pose.h>

#include <cmath>
#include <random>
#include <vector>

namespace walker {
namespace {

constexpr double kTolerance = 1e-14;

/// Expects both to rotate the axes alike; the quaternions' signs may differ.
void expect_same_rotation(const Eigen::Quaterniond& expected, const urdf::Rotation& actual) {
  for (const Vector3& axis : {Vector3{1, 0, 0}, Vector3{0, 1, 0}, Vector3{0, 0, 1}}) {
    const Eigen::Vector3d turned = expected * to_eigen(axis);
    const urdf::Vector3 other = actual * urdf::Vector3(axis[0], axis[1], axis[2]);
    EXPECT_NEAR(turned.x(), other.x, kTolerance);
    EXPECT_NEAR(turned.y(), other.y, kTolerance);
    EXPECT_NEAR(turned.z(), other.z, kTolerance);
  }
}

TEST(RollPitchYaw, ReadsBackAsTheSameRotation) {
  const double quarter = std::sqrt(0.5);
  std::vector<Quaternion> rotations{{0, 0, 0, 1},
                                    {0, 0, 1, 0},
                                    {0, quarter, 0, quarter},
                                    {0, -quarter, 0, quarter},
                                    {-0.5, -0.5, -0.5, 0.5},
                                    {0.5, -0.5, 0.5, 0.5}};
  std::mt19937 draws(1);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 100; ++i) {
    const Eigen::Vector4d q(normal(draws), normal(draws), normal(draws), normal(draws));
    const Eigen::Vector4d unit = q.normalized();
    rotations.push_back({unit[0], unit[1], unit[2], unit[3]});
  }
  for (const Quaternion& q : rotations) {
    const Vector3 angles = roll_pitch_yaw(q);
    urdf::Rotation read;
    read.setFromRPY(angles[0], angles[1], angles[2]);
    expect_same_rotation(to_eigen(q), read);
  }
}

TEST(RollPitchYaw, HasNoYawInGimbalLock) {
  const double quarter = std::sqrt(0.5);
  EXPECT_EQ(roll_pitch_yaw({0, -quarter, 0, quarter})[2], 0);
  EXPECT_EQ(roll_pitch_yaw({-0.5, -0.5, -0.5, 0.5})[2], 0);
}

TEST(Poses, AreTheIdentityExactly) {
  EXPECT_TRUE(is_identity(Pose{}));
  EXPECT_FALSE(is_identity({{0, 0, 1e-300}, {0, 0, 0, 1}}));
  EXPECT_FALSE(is_identity({{0, 0, 0}, {0, 1, 0, 0}}));
}

}  // namespace
}  // namespace walker
