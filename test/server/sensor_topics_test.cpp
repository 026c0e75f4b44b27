// Frames, signs and units of the sensor topics of every robot, against the in-process state and
// against geometry computed independently.
#include <gtest/gtest.h>
#include <urdf/model.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include <ros/ros.h>

#include "description/urdf_geometry.h"
#include "server/geometry.h"
#include "server/sensor_recording.h"

namespace walker::test {
namespace {

constexpr double kPi = 3.14159265358979323846;

const ExpectedRobot kBipedalWalker{
    {"hull", "upper_leg_1", "lower_leg_1", "upper_leg_2", "lower_leg_2"},
    {"hull", "upper_leg_1", "hull", "upper_leg_2"},
    {"hip_1", "knee_1", "hip_2", "knee_2"},
    {"lower_leg_1", "lower_leg_2"},
    {{"odom", "hull"},
     {"hull", "upper_leg_1"},
     {"upper_leg_1", "lower_leg_1"},
     {"hull", "upper_leg_2"},
     {"upper_leg_2", "lower_leg_2"},
     {"hull", "lidar"}},
    [](const std::vector<double>& observation) { return observation[0]; },
    0.02,
    160.0F / 30,
    10,  // pybox2d's default, which Gymnasium keeps
    1e-6,
    1e-3,
    0.2};

const ExpectedRobot kWalker2d{
    {"torso", "thigh", "leg", "foot", "thigh_left", "leg_left", "foot_left"},
    {"torso", "thigh", "leg", "torso", "thigh_left", "leg_left"},
    {"thigh_joint", "leg_joint", "foot_joint", "thigh_left_joint", "leg_left_joint",
     "foot_left_joint"},
    {"foot", "foot_left"},
    {{"odom", "torso"},
     {"torso", "thigh"},
     {"thigh", "leg_hinge"},
     {"leg", "foot_hinge"},
     {"torso", "thigh_left"},
     {"thigh_left", "leg_left_hinge"},
     {"leg_left", "foot_left_hinge"},
     {"torso", "lidar"}},
    [](const std::vector<double>& observation) { return -observation[1]; },
    0.008,
    160.0F / 68 * 1.01F,
    9.81,
    1e-12,  // TF rounds about ten times
    1e-9,
    0.05};

void stand_with_legs_apart(Player& player) {
  player.reset(1);
  repeat(player, 250, {1, 1, -1, 1});
}

const Walk kPlain{"plain",
                  {"", "", "BipedalWalker-v3", {}},
                  &kBipedalWalker,
                  [](Player& player) { follow_heuristic(player, 0); },
                  stand_with_legs_apart};
const Walk kHardcore{"hardcore",
                     {"/hardcore", "rough/", "BipedalWalkerHardcore-v3", {}},
                     &kBipedalWalker,
                     [](Player& player) { follow_heuristic(player, 3); },
                     stand_with_legs_apart};
const Walk kV5{"v5",
               {"/walker2d", "right/", "Walker2d-v5", {}},
               &kWalker2d,
               [](Player& player) { act_at_random(player, 10, 1000); },
               nullptr};
const Walk kFalling{"v4_falling",
                    {"/falling", "left/", "Walker2d-v4", {{"terminate_when_unhealthy", false}}},
                    &kWalker2d,
                    [](Player& player) {
                      act_at_random(player, 2, 150);
                      repeat(player, 400, std::vector<double>(6));
                    },
                    [](Player& player) { repeat(player, 1, std::vector<double>(6)); }};

std::string name_of(const testing::TestParamInfo<Walk>& info) { return info.param.name; }

class SensorTopics : public testing::TestWithParam<Walk> {
 protected:
  void SetUp() override {
    recording_ = &recording_of(GetParam());
    ASSERT_GT(walk().size(), 60U) << "the episode ended early";
  }

  static const ExpectedRobot& robot() { return *GetParam().robot; }
  const std::vector<State>& walk() const { return recording_->walk; }
  const std::vector<State>& rest() const { return recording_->rest; }
  const Scene& scene() const { return recording_->scene; }
  const tf2_msgs::TFMessage& constants() const { return recording_->fixed; }
  static std::string frame(const std::string& name) { return test::frame(GetParam().server, name); }

  tf2::Transform look_up(const State& state, const std::string& parent,
                         const std::string& child) const {
    return test::look_up(state.transforms, frame(parent), frame(child), constants());
  }

 private:
  const Recording* recording_ = nullptr;
};

TEST_P(SensorTopics, JointStatesEqualTheEngines) {
  for (const State& state : walk()) {
    EXPECT_EQ(state.joints.name, robot().joints);
    EXPECT_EQ(bits(state.joints.position), bits(state.truth.joint_position));
    EXPECT_EQ(bits(state.joints.velocity), bits(state.truth.joint_velocity));
    EXPECT_EQ(bits(state.joints.effort), bits(state.truth.joint_effort));
  }
}

TEST_P(SensorTopics, ContactsEqualTheEngines) {
  std::array<int, 2> counts{};
  for (const State& state : walk()) {
    ASSERT_EQ(state.contacts.links, robot().feet);
    ASSERT_EQ(state.contacts.in_contact.size(), 2U);
    for (std::size_t i = 0; i < 2; ++i) {
      const bool touches = state.truth.contacts[i] != 0;
      EXPECT_EQ(state.contacts.in_contact[i] != 0, touches) << robot().feet[i];
      ++counts[touches ? 1 : 0];
    }
  }
  EXPECT_GT(counts[0], 20) << "never in the air";
  EXPECT_GT(counts[1], 20) << "never on the ground";
}

TEST_P(SensorTopics, TfPlacesEveryLinkAtItsBody) {
  for (const State& state : walk()) {
    for (std::size_t i = 0; i < robot().links.size(); ++i) {
      const char* link = robot().links[i];
      const tf2::Transform pose = look_up(state, "odom", link);
      const Pose& body = state.truth.link_poses[i];
      EXPECT_LT(pose.getOrigin().distance(to_tf(body.position)), robot().tolerance) << link;
      EXPECT_LT(angle_between(pose.getRotation(), to_tf(body.orientation)), robot().tolerance)
          << link;
    }
  }
}

TEST_P(SensorTopics, TfTurnsJointsAboutMinusYByTheJointStates) {
  for (const State& state : walk()) {
    for (std::size_t i = 0; i < robot().joints.size(); ++i) {
      const tf2::Transform joint = look_up(state, robot().parents[i], robot().links[i + 1]);
      const tf2::Quaternion expected = about_minus_y(state.joints.position[i]);
      EXPECT_LT(angle_between(joint.getRotation(), expected), robot().tolerance)
          << robot().joints[i];
    }
  }
}

TEST_P(SensorTopics, FramesAndStampsAreThoseOfTheInterface) {
  const std::string trunk = frame(robot().links[0]);
  for (const State& state : walk()) {
    ASSERT_EQ(state.transforms.transforms.size(), robot().tree.size());
    for (const Edge& edge : robot().tree) {
      const auto found = transforms_to(frame(edge.child), state.transforms);
      ASSERT_EQ(found.size(), 1U) << edge.child;
      EXPECT_EQ(found[0].header.frame_id, frame(edge.parent));
      EXPECT_EQ(found[0].header.stamp, state.transition.header.stamp);
    }
    EXPECT_EQ(state.transition.header.frame_id, frame("odom"));
    EXPECT_EQ(state.odometry.header.frame_id, frame("odom"));
    EXPECT_EQ(state.odometry.child_frame_id, trunk);
    EXPECT_EQ(state.imu.header.frame_id, trunk);
    EXPECT_EQ(state.contacts.header.frame_id, frame("odom"));
  }
  for (std::size_t i = 1; i < walk().size(); ++i) {
    const ros::Duration passed =
        walk()[i].transition.header.stamp - walk()[i - 1].transition.header.stamp;
    EXPECT_EQ(passed.toNSec(), std::llround(robot().dt * 1e9));
  }
}

TEST_P(SensorTopics, OdometryIsTheTrunksWithTheTwistInItsFrame) {
  for (const State& state : walk()) {
    const tf2::Quaternion attitude = to_tf(state.odometry.pose.pose.orientation);
    const tf2::Vector3 position = to_tf(state.odometry.pose.pose.position);
    EXPECT_LT(position.distance(to_tf(state.truth.link_poses.front().position)), robot().tolerance);
    const double angle = robot().angle(state.transition.observation);
    EXPECT_LT(angle_between(attitude, about_minus_y(angle)), robot().tolerance);
    const tf2::Vector3 velocity =
        tf2::quatRotate(attitude, to_tf(state.odometry.twist.twist.linear));
    EXPECT_LT(velocity.distance(to_tf(state.truth.linear_velocity)), 1e-9);
    const tf2::Vector3 turning = to_tf(state.odometry.twist.twist.angular);
    EXPECT_NEAR(std::hypot(turning.x(), turning.z()), 0, 1e-12);
  }
}

/// The IMU reports specific force, acceleration minus gravity, in the trunk's frame.
TEST_P(SensorTopics, ImuFollowsRep145) {
  tf2::Vector3 last_velocity(0, 0, 0);
  for (const State& state : walk()) {
    const tf2::Quaternion attitude = to_tf(state.imu.orientation);
    const geometry_msgs::Twist& twist = state.odometry.twist.twist;
    EXPECT_LT(angle_between(attitude, to_tf(state.odometry.pose.pose.orientation)), 1e-12);
    EXPECT_LT(to_tf(state.imu.angular_velocity).distance(to_tf(twist.angular)), 1e-12);
    EXPECT_NE(state.imu.orientation_covariance[0], -1) << "-1: no orientation";
    EXPECT_NE(state.imu.linear_acceleration_covariance[0], -1);
    const tf2::Vector3 velocity = tf2::quatRotate(attitude, to_tf(twist.linear));
    const tf2::Vector3 force = tf2::quatRotate(attitude, to_tf(state.imu.linear_acceleration));
    const tf2::Vector3 gravity(0, 0, robot().gravity);
    if (state.transition.step > 0) {
      EXPECT_LT(force.distance((velocity - last_velocity) / robot().dt + gravity),
                robot().force_tolerance)
          << "step " << state.transition.step;
    }
    last_velocity = velocity;
  }
}

TEST_P(SensorTopics, ImuMeasuresGravityUpwardsAtRest) {
  if (rest().empty()) return;
  const sensor_msgs::Imu& imu = rest().back().imu;
  const tf2::Vector3 force =
      tf2::quatRotate(to_tf(imu.orientation), to_tf(imu.linear_acceleration));
  EXPECT_NEAR(force.x(), 0, robot().rest_tolerance);
  EXPECT_NEAR(force.y(), 0, 1e-9);
  EXPECT_NEAR(force.z(), robot().gravity, robot().rest_tolerance);
  if (robot().links[0] == std::string("torso")) {
    EXPECT_GT(std::abs(robot().angle(rest().back().transition.observation)), 0.5) << "not lying";
  }
}

TEST_P(SensorTopics, ScanIsAValidLaserScan) {
  for (const State& state : walk()) {
    const sensor_msgs::LaserScan& scan = state.scan;
    EXPECT_EQ(scan.header.frame_id, frame("lidar"));
    ASSERT_EQ(scan.ranges.size(), 10U);
    EXPECT_FLOAT_EQ(scan.angle_min, static_cast<float>(-kPi / 2));
    EXPECT_FLOAT_EQ(scan.angle_increment, 0.15F);
    const double count = (double{scan.angle_max} - scan.angle_min) / scan.angle_increment + 1;
    EXPECT_EQ(std::lround(count), 10);
    EXPECT_NEAR(count, 10, 1e-4);
    EXPECT_EQ(scan.time_increment, 0);
    EXPECT_EQ(scan.scan_time, static_cast<float>(robot().dt));
    EXPECT_EQ(scan.range_min, 0);
    EXPECT_FLOAT_EQ(scan.range_max, robot().range);
    EXPECT_TRUE(scan.intensities.empty());
    for (std::size_t i = 0; i < scan.ranges.size(); ++i) {
      const float range = scan.ranges[i];
      EXPECT_FALSE(std::isnan(range));
      if (std::isinf(range)) {
        EXPECT_GT(range, 0);
      } else {
        EXPECT_GE(range, scan.range_min);
        EXPECT_LE(range, scan.range_max);
      }
      EXPECT_EQ(range, static_cast<float>(state.truth.ranges[i]));
    }
  }
}

TEST_P(SensorTopics, LidarFrameIsGravityAlignedAtTheTrunk) {
  const tf2::Quaternion rolled(tf2::Vector3(1, 0, 0), kPi / 2);
  for (const State& state : walk()) {
    const tf2::Transform lidar = look_up(state, "odom", "lidar");
    const tf2::Transform trunk = look_up(state, "odom", robot().links[0]);
    EXPECT_LT(angle_between(lidar.getRotation(), rolled), 1e-6);
    EXPECT_LT(lidar.getOrigin().distance(trunk.getOrigin()), 1e-6);
  }
}

TEST_P(SensorTopics, RaysEndOnTheGround) {
  const std::vector<Segment> terrain = surfaces(scene());
  std::size_t hits = 0;
  std::size_t misses = 0;
  for (const State& state : walk()) {
    const tf2::Transform lidar = look_up(state, "odom", "lidar");
    const std::array<double, 2> origin{lidar.getOrigin().x(), lidar.getOrigin().z()};
    for (std::size_t i = 0; i < state.scan.ranges.size(); ++i) {
      const double angle = double{state.scan.angle_min} +
                           static_cast<double>(i) * double{state.scan.angle_increment};
      const tf2::Vector3 ray =
          tf2::quatRotate(lidar.getRotation(), tf2::Vector3(std::cos(angle), std::sin(angle), 0));
      const std::array<double, 2> direction{ray.x(), ray.z()};
      double expected = std::numeric_limits<double>::infinity();
      for (const Segment& segment : terrain) {
        expected = std::min(expected, distance_along(origin, direction, segment));
      }
      if (std::abs(expected - double{state.scan.range_max}) < 1e-3) continue;  // rounding decides
      const auto range = double{state.scan.ranges[i]};
      ASSERT_EQ(std::isinf(range), expected > double{state.scan.range_max})
          << "ray " << i << ": " << range << ", the terrain is at " << expected;
      if (std::isinf(range)) {
        ++misses;
        continue;
      }
      ++hits;
      EXPECT_NEAR(ray.y(), 0, 1e-6);
      const tf2::Vector3 end = lidar * (range * tf2::Vector3(std::cos(angle), std::sin(angle), 0));
      double nearest = std::numeric_limits<double>::infinity();
      for (const Segment& segment : terrain) {
        nearest = std::min(nearest, distance_to({end.x(), end.z()}, segment));
      }
      EXPECT_LT(nearest, 1e-3) << "ray " << i << " ends beside the terrain";
      EXPECT_NEAR(range, expected, 1e-2) << "ray " << i;
    }
  }
  EXPECT_GT(hits, 100U);
  EXPECT_GT(misses, 20U);
}

INSTANTIATE_TEST_SUITE_P(Robots, SensorTopics, testing::Values(kPlain, kHardcore, kV5, kFalling),
                         name_of);

class Walker2dTopics : public SensorTopics {};

TEST_P(Walker2dTopics, TfFollowsTheRobotDescription) {
  urdf::Model description;
  ASSERT_TRUE(description.initParam("/walker2d/robot_description"));  // fits both models
  for (const State& state : walk()) {
    std::map<std::string, double> angles;
    for (std::size_t i = 0; i < robot().joints.size(); ++i) {
      angles[state.joints.name[i]] = state.joints.position[i];
    }
    expect_the_kinematics_of(description, frame(""), angles, state.transforms, constants(),
                             robot().tolerance);
    if (HasFailure()) return;
  }
}

TEST_P(Walker2dTopics, StaticTransformsAreMountsAndBaseLink) {
  // A joint's child frame, to which the link's own frame is fixed.
  const std::array<const char*, 4> hinges{"leg_hinge", "foot_hinge", "leg_left_hinge",
                                          "foot_left_hinge"};
  ASSERT_EQ(constants().transforms.size(), 1 + hinges.size());
  for (const std::string hinge : hinges) {
    const auto found = transforms_to(frame(hinge.substr(0, hinge.rfind('_'))), constants());
    ASSERT_EQ(found.size(), 1U) << hinge;
    EXPECT_EQ(found[0].header.frame_id, frame(hinge));
  }
  const auto base_link = transforms_to(frame("base_link"), constants());
  ASSERT_EQ(base_link.size(), 1U);
  EXPECT_EQ(base_link[0].header.frame_id, frame("torso"));
}

INSTANTIATE_TEST_SUITE_P(Robots, Walker2dTopics, testing::Values(kV5, kFalling), name_of);

}  // namespace
}  // namespace walker::test
