// Frames, signs and units of the sensor topics, against the in-process state and against geometry
// computed independently.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <ros/ros.h>

#include "server/markers/plane_geometry.h"
#include "server/sensor_recording.h"
#include "server/tf_geometry.h"

namespace walker::test {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kGravity = 10;  // pybox2d's default, which Gymnasium keeps [m/s^2]

/// A frame and its parent, named as in docs/ros_interface.md.
struct Edge {
  const char* parent;
  const char* child;
};
constexpr std::array<Edge, 6> kTree{{{"odom", "hull"},
                                     {"hull", "upper_leg_1"},
                                     {"upper_leg_1", "lower_leg_1"},
                                     {"hull", "upper_leg_2"},
                                     {"upper_leg_2", "lower_leg_2"},
                                     {"hull", "lidar"}}};
constexpr std::array<const char*, 5> kLinks{"hull", "upper_leg_1", "lower_leg_1", "upper_leg_2",
                                            "lower_leg_2"};
constexpr std::array<const char*, 4> kJoints{"hip_1", "knee_1", "hip_2", "knee_2"};

/// A server in sensors_test.test, and a seed with which the heuristic does not fall early.
struct Walk {
  Server server;
  std::uint64_t seed;
};

class SensorTopics : public testing::TestWithParam<Walk> {
 protected:
  void SetUp() override {
    recording_ = &recording_of(GetParam().server, GetParam().seed);
    ASSERT_GT(recording_->walk.size(), 60U) << "the episode was to last";
  }

  const std::vector<State>& walk() const { return recording_->walk; }
  const Scene& scene() const { return recording_->scene; }
  const State& rest() const { return recording_->rest; }
  static std::string frame(const std::string& name) { return test::frame(GetParam().server, name); }
  static Vector3 center_of_mass() {
    return make(GetParam().server.id)->specification().links.front().center_of_mass;
  }

  static tf2::Transform look_up(const State& state, const std::string& parent,
                                const std::string& child) {
    return test::look_up(state.transforms, frame(parent), frame(child));
  }

 private:
  const Recording* recording_ = nullptr;
};

TEST_P(SensorTopics, JointStatesAreTheJoints) {
  for (const State& state : walk()) {
    const Sensors& truth = state.truth;
    ASSERT_EQ(state.joints.name.size(), kJoints.size());
    for (std::size_t i = 0; i < kJoints.size(); ++i) EXPECT_EQ(state.joints.name[i], kJoints[i]);
    EXPECT_EQ(bits(state.joints.position), bits(truth.joint_position));
    EXPECT_EQ(bits(state.joints.velocity), bits(truth.joint_velocity));
    EXPECT_EQ(bits(state.joints.effort), bits(truth.joint_effort));
    const auto& action = state.transition.action;
    for (std::size_t i = 0; i < action.size(); ++i) {
      // The torque limit is 80 N m times |action|; the motor may give less.
      EXPECT_LE(std::abs(state.joints.effort[i]), 80 * std::abs(action[i]) + 1e-3) << kJoints[i];
    }
  }
}

TEST_P(SensorTopics, TfOfEveryLinkIsItsBody) {
  for (const State& state : walk()) {
    const Sensors& truth = state.truth;
    for (std::size_t i = 0; i < kLinks.size(); ++i) {
      const tf2::Transform pose = look_up(state, "odom", kLinks[i]);
      const Pose& body = truth.link_poses[i];
      EXPECT_LT(pose.getOrigin().distance(to_tf(body.position)), 1e-6) << kLinks[i];
      EXPECT_LT(angle_between(pose.getRotation(), to_tf(body.orientation)), 1e-6) << kLinks[i];
    }
  }
}

TEST_P(SensorTopics, TfIsATreeWithTheNamesOfTheInterface) {
  for (const State& state : walk()) {
    ASSERT_EQ(state.transforms.transforms.size(), kTree.size());
    for (const Edge& edge : kTree) {
      const auto& all = state.transforms.transforms;
      const auto found = std::find_if(all.begin(), all.end(), [&](const auto& transform) {
        return transform.child_frame_id == frame(edge.child);
      });
      ASSERT_NE(found, all.end()) << edge.child;
      EXPECT_EQ(found->header.frame_id, frame(edge.parent));
      EXPECT_EQ(found->header.stamp, state.transition.header.stamp);
    }
    EXPECT_EQ(state.transition.header.frame_id, frame("odom"));
    EXPECT_EQ(state.odometry.header.frame_id, frame("odom"));
    EXPECT_EQ(state.odometry.child_frame_id, frame("hull"));
    EXPECT_EQ(state.imu.header.frame_id, frame("hull"));
    EXPECT_EQ(state.scan.header.frame_id, frame("lidar"));
  }
}

TEST_P(SensorTopics, AnglesOfJointStatesAreThoseOfTf) {
  for (const State& state : walk()) {
    for (std::size_t i = 0; i < kJoints.size(); ++i) {
      const Edge& edge = kTree[i + 1];
      const tf2::Transform joint = look_up(state, edge.parent, edge.child);
      const tf2::Quaternion expected = about_minus_y(state.joints.position[i]);
      EXPECT_LT(angle_between(joint.getRotation(), expected), 1e-6) << kJoints[i];
    }
  }
}

TEST_P(SensorTopics, OdometryIsOfTheHullsOriginInItsOwnFrame) {
  const Vector3 center = center_of_mass();
  ASSERT_GT(to_tf(center).length(), 0.01) << "else this test could not tell the two apart";
  bool is_distinct = false;
  for (const State& state : walk()) {
    const Sensors& truth = state.truth;
    const tf2::Quaternion attitude = to_tf(state.odometry.pose.pose.orientation);
    EXPECT_LT(
        to_tf(state.odometry.pose.pose.position).distance(to_tf(truth.link_poses.front().position)),
        1e-6);
    EXPECT_LT(angle_between(attitude, about_minus_y(state.transition.observation[0])), 1e-6);
    const tf2::Vector3 velocity =
        tf2::quatRotate(attitude, to_tf(state.odometry.twist.twist.linear));
    EXPECT_LT(velocity.distance(to_tf(truth.linear_velocity)), 1e-9);
    // The observation contains the scaled velocity of the centre of mass.
    const std::vector<double>& observation = state.transition.observation;
    const tf2::Vector3 of_center(observation[2] * 50 / 0.3 / 20, 0,
                                 observation[3] * 50 / 0.3 / (400.0 / 30));
    const tf2::Vector3 turning(0, -observation[1] * 50 / 2, 0);
    const tf2::Vector3 lever = tf2::quatRotate(attitude, to_tf(center));
    EXPECT_LT(velocity.distance(of_center - turning.cross(lever)), 1e-5);
    is_distinct = is_distinct || velocity.distance(of_center) > 1e-2;
    EXPECT_LT(to_tf(state.odometry.twist.twist.angular).distance(turning), 1e-5);
  }
  EXPECT_TRUE(is_distinct);
}

TEST_P(SensorTopics, ImuIsThatOfRep145) {
  tf2::Vector3 last_velocity(0, 0, 0);
  for (const State& state : walk()) {
    const tf2::Quaternion attitude = to_tf(state.imu.orientation);
    EXPECT_LT(angle_between(attitude, to_tf(state.odometry.pose.pose.orientation)), 1e-9);
    EXPECT_LT(to_tf(state.imu.angular_velocity).distance(to_tf(state.odometry.twist.twist.angular)),
              1e-9);
    EXPECT_NE(state.imu.orientation_covariance[0], -1) << "it has an orientation";
    EXPECT_NE(state.imu.linear_acceleration_covariance[0], -1);
    // The IMU reports specific force, acceleration minus gravity, in the hull's frame.
    const tf2::Vector3 velocity =
        tf2::quatRotate(attitude, to_tf(state.odometry.twist.twist.linear));
    const tf2::Vector3 force = tf2::quatRotate(attitude, to_tf(state.imu.linear_acceleration));
    const tf2::Vector3 expected = (velocity - last_velocity) / 0.02 + tf2::Vector3(0, 0, kGravity);
    if (state.transition.step > 0) {
      EXPECT_LT(force.distance(expected), 1e-3) << "step " << state.transition.step;
    }
    last_velocity = velocity;
  }
}

TEST_P(SensorTopics, AtRestTheImuFeelsOneGravityUpwards) {
  const sensor_msgs::Imu& imu = rest().imu;
  const tf2::Vector3 force =
      tf2::quatRotate(to_tf(imu.orientation), to_tf(imu.linear_acceleration));
  EXPECT_NEAR(force.x(), 0, 0.2);
  EXPECT_NEAR(force.y(), 0, 1e-9);
  EXPECT_NEAR(force.z(), kGravity, 0.2);
}

TEST_P(SensorTopics, ContactsAreThoseOfTheLowerLegs) {
  bool touched = false;
  bool flew = false;
  for (const State& state : walk()) {
    ASSERT_EQ(state.contacts.links, (std::vector<std::string>{"lower_leg_1", "lower_leg_2"}));
    ASSERT_EQ(state.contacts.in_contact.size(), 2U);
    EXPECT_EQ(state.contacts.in_contact[0] != 0, state.transition.observation[8] == 1);
    EXPECT_EQ(state.contacts.in_contact[1] != 0, state.transition.observation[13] == 1);
    touched = touched || state.contacts.in_contact[0] != 0;
    flew = flew || state.contacts.in_contact[0] == 0;
  }
  EXPECT_TRUE(touched && flew);
}

TEST_P(SensorTopics, TheObservationCanBeRebuiltFromTheSensors) {
  const tf2::Vector3 center = to_tf(center_of_mass());
  for (const State& state : walk()) {
    const tf2::Quaternion attitude = to_tf(state.imu.orientation);
    const tf2::Vector3 turning = to_tf(state.imu.angular_velocity);
    const tf2::Vector3 velocity =
        tf2::quatRotate(attitude, to_tf(state.odometry.twist.twist.linear) + turning.cross(center));
    std::vector<double> rebuilt{-2 * std::atan2(attitude.y(), attitude.w()), -2 * turning.y() / 50,
                                0.3 * velocity.x() * 20 / 50,
                                0.3 * velocity.z() * (400.0 / 30) / 50};
    for (std::size_t leg = 0; leg < 2; ++leg) {
      rebuilt.push_back(state.joints.position[2 * leg]);
      rebuilt.push_back(state.joints.velocity[2 * leg] / 4);
      rebuilt.push_back(state.joints.position[2 * leg + 1] + 1);
      rebuilt.push_back(state.joints.velocity[2 * leg + 1] / 6);
      rebuilt.push_back(state.contacts.in_contact[leg] != 0 ? 1 : 0);
    }
    for (const float range : state.scan.ranges) {
      rebuilt.push_back(std::isinf(range) ? 1.0 : double{range / state.scan.range_max});
    }
    ASSERT_EQ(rebuilt.size(), state.transition.observation.size());
    for (std::size_t i = 0; i < rebuilt.size(); ++i) {
      EXPECT_NEAR(rebuilt[i], state.transition.observation[i], 2e-6) << "observation " << i;
    }
  }
}

TEST_P(SensorTopics, ScanKeepsTheInvariantsOfLaserScan) {
  for (const State& state : walk()) {
    const sensor_msgs::LaserScan& scan = state.scan;
    ASSERT_EQ(scan.ranges.size(), 10U);
    EXPECT_FLOAT_EQ(scan.angle_min, static_cast<float>(-kPi / 2));
    EXPECT_FLOAT_EQ(scan.angle_increment, 0.15F);
    const double count = (double{scan.angle_max} - scan.angle_min) / scan.angle_increment + 1;
    EXPECT_EQ(std::lround(count), 10);
    EXPECT_NEAR(count, 10, 1e-4);
    EXPECT_EQ(scan.time_increment, 0);
    EXPECT_EQ(scan.scan_time, 0.02F);
    EXPECT_EQ(scan.range_min, 0);
    EXPECT_FLOAT_EQ(scan.range_max, 160.0F / 30);
    EXPECT_TRUE(scan.intensities.empty());
    const Sensors& truth = state.truth;
    for (std::size_t i = 0; i < scan.ranges.size(); ++i) {
      const float range = scan.ranges[i];
      EXPECT_FALSE(std::isnan(range));
      if (std::isinf(range)) {
        EXPECT_GT(range, 0);
      } else {
        EXPECT_GE(range, scan.range_min);
        EXPECT_LE(range, scan.range_max);
      }
      EXPECT_EQ(range, static_cast<float>(truth.ranges[i]));
    }
  }
}

TEST_P(SensorTopics, LidarFrameIsGravityAlignedAtTheHull) {
  const tf2::Quaternion rolled(tf2::Vector3(1, 0, 0), kPi / 2);
  for (const State& state : walk()) {
    const tf2::Transform lidar = look_up(state, "odom", "lidar");
    const tf2::Transform hull = look_up(state, "odom", "hull");
    EXPECT_LT(angle_between(lidar.getRotation(), rolled), 1e-6);
    EXPECT_LT(lidar.getOrigin().distance(hull.getOrigin()), 1e-6);
  }
}

TEST_P(SensorTopics, RaysEndOnTheTerrainOrMeetNothing) {
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
          << "ray " << i << ": told " << range << ", the terrain is at " << expected;
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

INSTANTIATE_TEST_SUITE_P(
    Servers, SensorTopics,
    testing::Values(Walk{{"", "", "BipedalWalker-v3", {}}, 0},
                    Walk{{"/hardcore", "rough/", "BipedalWalkerHardcore-v3", {}}, 3}),
    [](const testing::TestParamInfo<Walk>& walk) {
      return walk.index == 0 ? "plain" : "hardcore";
    });

}  // namespace
}  // namespace walker::test
