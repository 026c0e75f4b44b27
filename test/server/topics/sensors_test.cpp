// Frames, signs and units of the sensors' messages, against explicit formulas. The robots' rooms
// compare the sensors with the engines, urdf_kinematics_test.cpp the transforms with the
// description, and observation_topics_test.cpp the published messages with the observation.
#include "walker_sim/sensors.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "bits.h"
#include "description/urdf_geometry.h"
#include "pose_algebra.h"
#include "server/topics/converters.h"
#include "stepper.h"
#include "walker_sim/agent.h"

namespace walker {
namespace {

struct Case {
  const char* id;
  Parameters parameters;
  const char* agent;
  int steps;
  std::string trunk;
  std::vector<std::string> feet;
  double dt;               // [s]
  float range;             // of the lidar [m]
  double gravity;          // [m/s^2]
  double tolerance;        // of poses [m, rad]
  double force_tolerance;  // [m/s^2]
};

Vector3 to_vector(const geometry_msgs::Vector3& v) { return {v.x, v.y, v.z}; }
Quaternion to_quaternion(const geometry_msgs::Quaternion& q) { return {q.x, q.y, q.z, q.w}; }

void expect_vector(const Vector3& expected, const Vector3& actual, double tolerance) {
  for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(actual[k], expected[k], tolerance) << "xyz"[k];
}

class SensorMessages : public testing::TestWithParam<Case> {
 protected:
  /// Calls `check` after the reset and after each step, with messages of the state.
  template <typename Check>
  void walk(const Check& check) {
    const std::unique_ptr<Agent> agent = make_agent(GetParam().agent, specification(), 1);
    stepper_.reset(1);
    for (step_ = 0; step_ <= GetParam().steps && !HasFailure(); ++step_) {
      if (step_ > 0) stepper_.step(agent->act(stepper_.observation));
      ASSERT_FALSE(stepper_.has_ended()) << step_;
      stepper_.environment->sense(sensors_);
      to_message(specification(), sensors_, stamp_, joints_);
      to_message(specification(), sensors_, frames_, stamp_, contacts_);
      to_message(specification(), sensors_, frames_, stamp_, scan_);
      to_message(specification(), sensors_, frames_, stamp_, transforms_);
      to_message(sensors_, frames_, stamp_, imu_);
      to_message(sensors_, frames_, stamp_, odometry_);
      check();
    }
  }

  const Specification& specification() const { return stepper_.environment->specification(); }

  /// Follows the transforms from odom.
  Pose pose_of(const std::string& frame) const {
    if (frame == "robot/odom") return {};
    auto found = transforms_to(frame, transforms_);
    if (found.empty()) found = transforms_to(frame, constants_);
    if (found.size() != 1) throw std::out_of_range(frame);
    return composed(pose_of(found[0].header.frame_id), to_pose(found[0].transform));
  }

  Stepper stepper_{GetParam().id, GetParam().parameters};
  const Frames frames_{specification(), "robot"};
  const ros::Time stamp_{1, 2};
  const tf2_msgs::TFMessage constants_ = static_transforms(specification(), frames_, stamp_);
  int step_ = 0;
  Sensors sensors_;
  sensor_msgs::JointState joints_;
  walker_sim::Contacts contacts_;
  sensor_msgs::LaserScan scan_;
  tf2_msgs::TFMessage transforms_;
  sensor_msgs::Imu imu_;
  nav_msgs::Odometry odometry_;
};

TEST_P(SensorMessages, HaveTheFramesOfTheInterface) {
  walk([this] {
    const std::string trunk = "robot/" + GetParam().trunk;
    EXPECT_EQ(odometry_.header.frame_id, "robot/odom");
    EXPECT_EQ(odometry_.child_frame_id, trunk);
    EXPECT_EQ(imu_.header.frame_id, trunk);
    EXPECT_EQ(contacts_.header.frame_id, "robot/odom");
    EXPECT_EQ(scan_.header.frame_id, "robot/lidar");
    EXPECT_EQ(transforms_to("robot/lidar", transforms_).at(0).header.frame_id, trunk);
    EXPECT_EQ(transforms_to("robot/base_link", constants_).at(0).header.frame_id, trunk);
  });
}

TEST_P(SensorMessages, HaveTheValuesOfTheSensors) {
  std::array<int, 2> contacts{};
  std::array<int, 2> hits{};
  walk([&] {
    for (std::size_t i = 0; i < specification().joints.size(); ++i) {
      EXPECT_EQ(joints_.name.at(i), specification().joints[i].name);
    }
    EXPECT_EQ(to_bits(joints_.position), to_bits(sensors_.joint_position));
    EXPECT_EQ(to_bits(joints_.velocity), to_bits(sensors_.joint_velocity));
    EXPECT_EQ(to_bits(joints_.effort), to_bits(sensors_.joint_effort));
    EXPECT_EQ(contacts_.links, GetParam().feet);
    EXPECT_EQ(contacts_.in_contact.size(), 2U);
    for (std::size_t i = 0; i < contacts_.in_contact.size(); ++i) {
      EXPECT_EQ(contacts_.in_contact[i], sensors_.contacts[i]);
      ++contacts[contacts_.in_contact[i]];
    }
    EXPECT_EQ(scan_.ranges.size(), 10U);
    for (std::size_t i = 0; i < scan_.ranges.size(); ++i) {
      const float range = scan_.ranges[i];
      EXPECT_EQ(range, static_cast<float>(sensors_.ranges[i]));
      EXPECT_TRUE(range >= 0 && (std::isinf(range) || range <= scan_.range_max)) << range;
      ++hits[std::isinf(range) ? 0 : 1];
    }
  });
  for (const auto& counts : {contacts, hits}) {
    EXPECT_GT(counts[0], 20) << "never in the air, or all rays hit";
    EXPECT_GT(counts[1], 20) << "never on the ground, or no ray hits";
  }
}

TEST_P(SensorMessages, ScanCountsFromDownwards) {
  walk([this] {
    EXPECT_FLOAT_EQ(scan_.angle_min, static_cast<float>(-M_PI / 2));
    EXPECT_FLOAT_EQ(scan_.angle_increment, 0.15F);
    const double count = (double{scan_.angle_max} - scan_.angle_min) / scan_.angle_increment + 1;
    EXPECT_NEAR(count, 10, 1e-4);
    EXPECT_EQ(scan_.time_increment, 0);
    EXPECT_EQ(scan_.scan_time, static_cast<float>(GetParam().dt));
    EXPECT_EQ(scan_.range_min, 0);
    EXPECT_FLOAT_EQ(scan_.range_max, GetParam().range);
    EXPECT_TRUE(scan_.intensities.empty());
  });
}

TEST_P(SensorMessages, TransformsPlaceTheLinksAndALevelLidar) {
  walk([this] {
    for (std::size_t i = 0; i < specification().links.size(); ++i) {
      expect_same_pose(sensors_.link_poses[i], pose_of(frames_.links[i]), GetParam().tolerance,
                       frames_.links[i]);
    }
    const Vector3& trunk = sensors_.link_poses[0].position;
    expect_same_pose({trunk, rotation({1, 0, 0}, M_PI / 2)}, pose_of("robot/lidar"), 1e-6, "lidar");
    expect_same_pose(pose_of(frames_.trunk), pose_of("robot/base_link"), 0, "base_link");
  });
}

TEST_P(SensorMessages, OdometryIsTheTrunksWithTheTwistInItsFrame) {
  walk([this] {
    const auto& [position, orientation] = odometry_.pose.pose;
    const Quaternion attitude = to_quaternion(orientation);
    const Pose pose{{position.x, position.y, position.z}, attitude};
    expect_same_pose(sensors_.link_poses[0], pose, GetParam().tolerance, "trunk");
    const geometry_msgs::Twist& twist = odometry_.twist.twist;
    expect_vector(sensors_.linear_velocity, rotated(attitude, to_vector(twist.linear)), 1e-9);
    expect_vector(sensors_.angular_velocity, to_vector(twist.angular), 1e-12);
  });
}

/// The IMU reports specific force, acceleration minus gravity, in the trunk's frame.
TEST_P(SensorMessages, ImuFollowsRep145) {
  Vector3 last_velocity{};
  walk([&] {
    const Quaternion attitude = to_quaternion(imu_.orientation);
    const geometry_msgs::Twist& twist = odometry_.twist.twist;
    EXPECT_EQ(attitude, to_quaternion(odometry_.pose.pose.orientation));
    expect_vector(to_vector(twist.angular), to_vector(imu_.angular_velocity), 1e-12);
    EXPECT_NE(imu_.orientation_covariance[0], -1) << "-1: no orientation";
    EXPECT_NE(imu_.linear_acceleration_covariance[0], -1);
    const Vector3 velocity = rotated(attitude, to_vector(twist.linear));
    Vector3 expected{0, 0, GetParam().gravity};
    for (std::size_t k = 0; k < 3; ++k)
      expected[k] += (velocity[k] - last_velocity[k]) / GetParam().dt;
    if (step_ > 0) {
      expect_vector(expected, rotated(attitude, to_vector(imu_.linear_acceleration)),
                    GetParam().force_tolerance);
    }
    last_velocity = velocity;
  });
}

const Case kBipedalWalker{"BipedalWalker-v3",
                          {},
                          "heuristic",
                          120,
                          "hull",
                          {"lower_leg_1", "lower_leg_2"},
                          0.02,
                          160.0F / 30,
                          10,  // pybox2d's default, which Gymnasium keeps
                          1e-6,
                          1e-3};
// It keeps stepping after it falls, so that the torso takes every attitude.
const Case kWalker2d{"Walker2d-v5", {{"terminate_when_unhealthy", false}},
                     "random",      400,
                     "torso",       {"foot", "foot_left"},
                     0.008,         160.0F / 68 * 1.01F,
                     9.81,          1e-12,
                     1e-9};

INSTANTIATE_TEST_SUITE_P(Robots, SensorMessages, testing::Values(kBipedalWalker, kWalker2d),
                         [](const auto& robot) { return std::string(robot.param.id, 8); });

}  // namespace
}  // namespace walker
