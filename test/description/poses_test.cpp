// Compares our rotations with those of urdfdom.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "description/urdf_geometry.h"

namespace walker {
namespace {

constexpr double kTolerance = 1e-14;

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
    urdf::Pose read;
    read.rotation.setFromRPY(angles[0], angles[1], angles[2]);
    expect_same_pose(to_urdf(Pose{{0, 0, 0}, q}), read, kTolerance, "rotation");
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
