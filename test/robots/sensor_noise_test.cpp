// Errors of sensors, added to Sensors.
#include <gtest/gtest.h>

#include <limits>

#include "pose_algebra.h"
#include "robots/robot.h"

namespace walker {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

Sensors some_sensors() {
  Sensors sensors;
  sensors.joint_position = {0.1, 0.2};
  sensors.joint_velocity = {1, 2};
  sensors.link_poses = {{{1, 2, 3}, rotation({0, 1, 0}, 0.3)}, {{4, 5, 6}, {0, 0, 0, 1}}};
  sensors.linear_velocity = {1, 2, 3};
  sensors.angular_velocity = {4, 5, 6};
  sensors.ranges = {1, 2, kInfinity, 0.5};
  sensors.maximum_range = 3;
  sensors.contacts = {0, 1};
  return sensors;
}

TEST(SensorNoiseTest, IsAddedToEveryQuantity) {
  Sensors sensors = some_sensors();
  SensorNoise noise;
  noise.joint_position = {0.5, -0.25};
  noise.joint_velocity = {-3, 4};
  noise.pitch = 0.2;
  noise.angular_velocity = 10;
  noise.linear_velocity = {0.5, -0.5};
  noise.ranges = {0.25, 5, 7, -2};
  add(noise, sensors);
  EXPECT_EQ(sensors.joint_position, (std::vector<double>{0.1 + 0.5, 0.2 - 0.25}));
  EXPECT_EQ(sensors.joint_velocity, (std::vector<double>{-2, 6}));
  EXPECT_EQ(sensors.angular_velocity, (Vector3{4, 15, 6}));
  EXPECT_EQ(sensors.linear_velocity, (Vector3{1.5, 2, 2.5}));
  EXPECT_EQ(sensors.ranges, (std::vector<double>{1.25, 3, kInfinity, 0}))
      << "between 0 and the maximum; a ray without a hit stays one";
  EXPECT_EQ(sensors.contacts, (std::vector<std::uint8_t>{0, 1}));
  EXPECT_EQ(sensors.link_poses[0].position, (Vector3{1, 2, 3}));
  EXPECT_EQ(sensors.link_poses[1].orientation, (Quaternion{0, 0, 0, 1}));
}

TEST(SensorNoiseTest, PitchTurnsTheTrunkAboutTheWorldsY) {
  const Quaternion tilted = composed(rotation({0, 0, 1}, 0.7), rotation({1, 0, 0}, -0.4));
  Sensors sensors = some_sensors();
  sensors.link_poses[0].orientation = tilted;
  SensorNoise noise;
  noise.pitch = 0.2;
  add(noise, sensors);
  const Quaternion expected = composed(rotation({0, 1, 0}, 0.2), tilted);
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_NEAR(sensors.link_poses[0].orientation[k], expected[k], 1e-15);
  }
}

TEST(SensorNoiseTest, NoNoiseChangesNothing) {
  Sensors sensors = some_sensors();
  add({}, sensors);
  const Sensors before = some_sensors();
  EXPECT_EQ(sensors.link_poses[0].orientation, before.link_poses[0].orientation);
  EXPECT_EQ(sensors.joint_position, before.joint_position);
  EXPECT_EQ(sensors.joint_velocity, before.joint_velocity);
  EXPECT_EQ(sensors.linear_velocity, before.linear_velocity);
  EXPECT_EQ(sensors.angular_velocity, before.angular_velocity);
  EXPECT_EQ(sensors.ranges, before.ranges);
}

}  // namespace
}  // namespace walker
