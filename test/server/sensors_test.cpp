// What the topics tell of a state, against the same state in process and against geometry worked
// out here: frames, signs, units.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>

#include <nav_msgs/Odometry.h>
#include <ros/ros.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/JointState.h>
#include <sensor_msgs/LaserScan.h>
#include <std_msgs/Float64.h>
#include <std_msgs/Float64MultiArray.h>
#include <tf2/LinearMath/Quaternion.h>
#include <tf2/LinearMath/Transform.h>
#include <tf2/buffer_core.h>
#include <tf2_msgs/TFMessage.h>

#include "bipedal_walker/heuristic.h"
#include "server/inbox.h"
#include "server/remote.h"
#include "server/twin.h"
#include "walker_sim/Contacts.h"

namespace walker::test {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kGravity = 10;  // Box2D's default, which Gymnasium keeps [m/s^2]

tf2::Vector3 to_tf(const geometry_msgs::Vector3& v) { return {v.x, v.y, v.z}; }
tf2::Vector3 to_tf(const geometry_msgs::Point& p) { return {p.x, p.y, p.z}; }
tf2::Vector3 to_tf(const Vector3& v) { return {v[0], v[1], v[2]}; }
tf2::Quaternion to_tf(const geometry_msgs::Quaternion& q) { return {q.x, q.y, q.z, q.w}; }
tf2::Quaternion to_tf(const Quaternion& q) { return {q[0], q[1], q[2], q[3]}; }

/// Box2D's +angle is a rotation about -y.
tf2::Quaternion about_minus_y(double angle) { return {tf2::Vector3(0, -1, 0), angle}; }

/// [rad] between two rotations; the sign of a quaternion does not matter.
double angle_between(const tf2::Quaternion& a, const tf2::Quaternion& b) {
  const tf2::Quaternion turn = a.inverse() * b;
  return 2 * std::asin(std::min(1.0, tf2::Vector3(turn.x(), turn.y(), turn.z()).length()));
}

/// The joints' frames in their parents, as ros-conventions and interface.md name them.
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

/// All that a server publishes of one state.
struct State {
  walker_sim::Transition transition;
  sensor_msgs::JointState joints;
  sensor_msgs::LaserScan scan;
  sensor_msgs::Imu imu;
  nav_msgs::Odometry odometry;
  walker_sim::Contacts contacts;
  tf2_msgs::TFMessage transforms;
};

struct Server {
  const char* space;      // of the node and its topics
  const char* tf_prefix;  // as in sensors.test
  const char* id;
  std::uint64_t seed;  // an episode in which the heuristic lasts
};

class SensorTopics : public testing::TestWithParam<Server> {
 protected:
  SensorTopics()
      : remote_(GetParam().space + std::string("/walker_sim")),
        twin_(GetParam().id),
        joints_(node_, topic("joint_states")),
        scans_(node_, topic("scan")),
        imus_(node_, topic("imu")),
        odometries_(node_, topic("odom")),
        contacts_(node_, topic("contacts")),
        transforms_(node_, "/tf") {}

  static std::string topic(const std::string& name) { return GetParam().space + ("/" + name); }
  static std::string frame(const std::string& name) { return GetParam().tf_prefix + name; }

  /// @param check what must hold of each state
  template <typename Check>
  void for_each_state(int steps, Check check) {
    bipedal_walker::Heuristic heuristic;
    twin_.reset(GetParam().seed);
    State state;
    collect(remote_.reset(GetParam().seed), state);
    check(state);
    for (int i = 0; i < steps && !HasFailure() && !twin_.has_ended(); ++i) {
      std::vector<double> action(4);
      heuristic.act(twin_.observation().data(), action.data());
      twin_.step(action);
      collect(remote_.step(action), state);
      ASSERT_TRUE(twin_.equals(state.transition));
      check(state);
    }
    EXPECT_GT(state.transition.step, 40U) << "the episode was to last";
  }

  /// Waits for the messages with the transition's stamp.
  void collect(const walker_sim::Transition& transition, State& state) {
    state.transition = transition;
    const ros::Time stamp = transition.header.stamp;
    take(joints_.at(stamp), state.joints);
    take(scans_.at(stamp), state.scan);
    take(imus_.at(stamp), state.imu);
    take(odometries_.at(stamp), state.odometry);
    take(contacts_.at(stamp), state.contacts);
    // Both servers publish /tf, with stamps of their own.
    take(transforms_.find([&](const tf2_msgs::TFMessage& message) {
      return stamp_of(message) == stamp &&
             message.transforms.front().header.frame_id == frame("odom");
    }),
         state.transforms);
  }

  template <typename Message>
  static void take(const std::optional<Message>& found, Message& place) {
    ASSERT_TRUE(found) << "a topic lacks the stamp of the step";
    place = *found;
  }

  /// `child` in `parent`, through tf2.
  static tf2::Transform look_up(const State& state, const std::string& parent,
                                const std::string& child) {
    tf2::BufferCore buffer;
    for (const auto& transform : state.transforms.transforms) {
      EXPECT_TRUE(buffer.setTransform(transform, "test"));
    }
    const geometry_msgs::Transform found =
        buffer.lookupTransform(frame(parent), frame(child), state.transition.header.stamp)
            .transform;
    return {to_tf(found.rotation), to_tf(found.translation)};
  }

  ros::NodeHandle node_;
  Remote remote_;
  Twin twin_;
  Inbox<sensor_msgs::JointState> joints_;
  Inbox<sensor_msgs::LaserScan> scans_;
  Inbox<sensor_msgs::Imu> imus_;
  Inbox<nav_msgs::Odometry> odometries_;
  Inbox<walker_sim::Contacts> contacts_;
  Inbox<tf2_msgs::TFMessage> transforms_;
};

TEST_P(SensorTopics, JointStatesAreTheJoints) {
  for_each_state(60, [this](const State& state) {
    const Sensors& truth = twin_.sense();
    ASSERT_EQ(state.joints.name.size(), kJoints.size());
    for (std::size_t i = 0; i < kJoints.size(); ++i) EXPECT_EQ(state.joints.name[i], kJoints[i]);
    EXPECT_EQ(bits(state.joints.position), bits(truth.joint_position));
    EXPECT_EQ(bits(state.joints.velocity), bits(truth.joint_velocity));
    EXPECT_EQ(bits(state.joints.effort), bits(truth.joint_effort));
    const auto& action = state.transition.action;
    for (std::size_t i = 0; i < action.size(); ++i) {
      // The motor may give less than its cap, never more.
      EXPECT_LE(std::abs(state.joints.effort[i]), 80 * std::abs(action[i]) + 1e-3) << kJoints[i];
    }
  });
}

TEST_P(SensorTopics, TfOfEveryLinkIsItsBody) {
  for_each_state(60, [this](const State& state) {
    const Sensors& truth = twin_.sense();
    for (std::size_t i = 0; i < kLinks.size(); ++i) {
      const tf2::Transform pose = look_up(state, "odom", kLinks[i]);
      const Pose& body = truth.link_poses[i];
      EXPECT_LT(pose.getOrigin().distance(to_tf(body.position)), 1e-6) << kLinks[i];
      EXPECT_LT(angle_between(pose.getRotation(), to_tf(body.orientation)), 1e-6) << kLinks[i];
    }
  });
}

TEST_P(SensorTopics, TfIsATreeWithTheNamesOfTheInterface) {
  for_each_state(45, [](const State& state) {
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
  });
}

TEST_P(SensorTopics, AnglesOfJointStatesAreThoseOfTf) {
  for_each_state(60, [](const State& state) {
    for (std::size_t i = 0; i < kJoints.size(); ++i) {
      const Edge& edge = kTree[i + 1];
      const tf2::Transform joint = look_up(state, edge.parent, edge.child);
      const tf2::Quaternion expected = about_minus_y(state.joints.position[i]);
      EXPECT_LT(angle_between(joint.getRotation(), expected), 1e-6) << kJoints[i];
    }
  });
}

TEST_P(SensorTopics, OdometryIsOfTheHullsOriginInItsOwnFrame) {
  const Vector3 center = twin_.environment().specification().links.front().center_of_mass;
  ASSERT_GT(to_tf(center).length(), 0.01) << "else this test could not tell the two apart";
  bool is_distinct = false;
  for_each_state(60, [&](const State& state) {
    const Sensors& truth = twin_.sense();
    const tf2::Quaternion attitude = to_tf(state.odometry.pose.pose.orientation);
    EXPECT_LT(to_tf(state.odometry.pose.pose.position)
                  .distance(to_tf(truth.link_poses.front().position)),
              1e-6);
    EXPECT_LT(angle_between(attitude, about_minus_y(state.transition.observation[0])), 1e-6);
    const tf2::Vector3 velocity =
        tf2::quatRotate(attitude, to_tf(state.odometry.twist.twist.linear));
    EXPECT_LT(velocity.distance(to_tf(truth.linear_velocity)), 1e-9);
    // The observation tells the velocity of the centre of mass, in its own units.
    const std::vector<double>& observation = state.transition.observation;
    const tf2::Vector3 of_center(observation[2] * 50 / 0.3 / 20, 0,
                                 observation[3] * 50 / 0.3 / (400.0 / 30));
    const tf2::Vector3 turning(0, -observation[1] * 50 / 2, 0);
    const tf2::Vector3 lever = tf2::quatRotate(attitude, to_tf(center));
    EXPECT_LT(velocity.distance(of_center - turning.cross(lever)), 1e-5);
    is_distinct = is_distinct || velocity.distance(of_center) > 1e-2;
    EXPECT_LT(to_tf(state.odometry.twist.twist.angular).distance(turning), 1e-5);
  });
  EXPECT_TRUE(is_distinct);
}

TEST_P(SensorTopics, ImuIsThatOfRep145) {
  tf2::Vector3 last_velocity(0, 0, 0);
  for_each_state(80, [&](const State& state) {
    const tf2::Quaternion attitude = to_tf(state.imu.orientation);
    EXPECT_LT(angle_between(attitude, to_tf(state.odometry.pose.pose.orientation)), 1e-9);
    EXPECT_LT(to_tf(state.imu.angular_velocity)
                  .distance(to_tf(state.odometry.twist.twist.angular)),
              1e-9);
    EXPECT_NE(state.imu.orientation_covariance[0], -1) << "it has an orientation";
    EXPECT_NE(state.imu.linear_acceleration_covariance[0], -1);
    // Specific force: what accelerates the hull beyond free fall, in the hull's frame.
    const tf2::Vector3 velocity =
        tf2::quatRotate(attitude, to_tf(state.odometry.twist.twist.linear));
    const tf2::Vector3 force = tf2::quatRotate(attitude, to_tf(state.imu.linear_acceleration));
    const tf2::Vector3 expected = (velocity - last_velocity) / 0.02 + tf2::Vector3(0, 0, kGravity);
    if (state.transition.step > 0) {
      EXPECT_LT(force.distance(expected), 1e-3) << "step " << state.transition.step;
    }
    last_velocity = velocity;
  });
}

TEST_P(SensorTopics, AtRestTheImuFeelsOneGravityUpwards) {
  remote_.reset(1);
  walker_sim::Transition last;
  for (int i = 0; i < 250; ++i) last = remote_.step({1, 1, -1, 1});  // stands astride
  ASSERT_FALSE(last.terminated);
  const auto imu = imus_.at(last.header.stamp);
  ASSERT_TRUE(imu);
  const tf2::Vector3 force =
      tf2::quatRotate(to_tf(imu->orientation), to_tf(imu->linear_acceleration));
  EXPECT_NEAR(force.x(), 0, 0.2);
  EXPECT_NEAR(force.y(), 0, 1e-9);
  EXPECT_NEAR(force.z(), kGravity, 0.2);
}

TEST_P(SensorTopics, ContactsAreThoseOfTheLowerLegs) {
  bool touched = false;
  bool flew = false;
  for_each_state(80, [&](const State& state) {
    ASSERT_EQ(state.contacts.links, (std::vector<std::string>{"lower_leg_1", "lower_leg_2"}));
    ASSERT_EQ(state.contacts.in_contact.size(), 2U);
    EXPECT_EQ(state.contacts.in_contact[0] != 0, state.transition.observation[8] == 1);
    EXPECT_EQ(state.contacts.in_contact[1] != 0, state.transition.observation[13] == 1);
    touched = touched || state.contacts.in_contact[0] != 0;
    flew = flew || state.contacts.in_contact[0] == 0;
  });
  EXPECT_TRUE(touched && flew);
}

/// As a robot's policy would do it.
TEST_P(SensorTopics, TheObservationCanBeRebuiltFromTheSensors) {
  const tf2::Vector3 center =
      to_tf(twin_.environment().specification().links.front().center_of_mass);
  for_each_state(60, [&](const State& state) {
    const tf2::Quaternion attitude = to_tf(state.imu.orientation);
    const tf2::Vector3 turning = to_tf(state.imu.angular_velocity);
    const tf2::Vector3 velocity = tf2::quatRotate(
        attitude, to_tf(state.odometry.twist.twist.linear) + turning.cross(center));
    std::vector<double> rebuilt{-2 * std::atan2(attitude.y(), attitude.w()),
                                -2 * turning.y() / 50, 0.3 * velocity.x() * 20 / 50,
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
  });
}

// ------------------------------------------------------------------ the scan

TEST_P(SensorTopics, ScanKeepsTheInvariantsOfLaserScan) {
  for_each_state(60, [this](const State& state) {
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
    const Sensors& truth = twin_.sense();
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
  });
}

TEST_P(SensorTopics, LidarFrameIsGravityAlignedAtTheHull) {
  const tf2::Quaternion rolled(tf2::Vector3(1, 0, 0), kPi / 2);
  for_each_state(60, [&](const State& state) {
    const tf2::Transform lidar = look_up(state, "odom", "lidar");
    const tf2::Transform hull = look_up(state, "odom", "hull");
    EXPECT_LT(angle_between(lidar.getRotation(), rolled), 1e-6);
    EXPECT_LT(lidar.getOrigin().distance(hull.getOrigin()), 1e-6);
  });
}

/// A piece of ground or an edge of an obstacle, in the world's x,z plane.
struct Segment {
  std::array<double, 2> from;
  std::array<double, 2> to;
};

std::vector<Segment> surfaces(const Scene& scene) {
  std::vector<Segment> segments;
  for (const ScenePolygon& ground : scene.ground) {
    segments.push_back({ground.points[0], ground.points[1]});
  }
  for (const ScenePolygon& obstacle : scene.obstacles) {
    for (std::size_t i = 0; i < obstacle.points.size(); ++i) {
      segments.push_back({obstacle.points[i], obstacle.points[(i + 1) % obstacle.points.size()]});
    }
  }
  return segments;
}

/// Distance from `origin` along the unit vector `direction` to the segment; infinite: misses it.
double distance_along(const std::array<double, 2>& origin, const std::array<double, 2>& direction,
                      const Segment& segment) {
  constexpr double kMiss = std::numeric_limits<double>::infinity();
  const double ex = segment.to[0] - segment.from[0];
  const double ez = segment.to[1] - segment.from[1];
  const double dx = segment.from[0] - origin[0];
  const double dz = segment.from[1] - origin[1];
  const double determinant = ex * direction[1] - ez * direction[0];
  if (std::abs(determinant) < 1e-12) return kMiss;
  const double along = (ex * dz - ez * dx) / determinant;
  const double part = (direction[0] * dz - direction[1] * dx) / determinant;
  return along >= 0 && part >= -1e-6 && part <= 1 + 1e-6 ? along : kMiss;
}

double distance_to(const std::array<double, 2>& point, const Segment& segment) {
  const double ex = segment.to[0] - segment.from[0];
  const double ez = segment.to[1] - segment.from[1];
  const double length_squared = ex * ex + ez * ez;
  double part = 0;
  if (length_squared > 0) {
    part = ((point[0] - segment.from[0]) * ex + (point[1] - segment.from[1]) * ez) / length_squared;
  }
  part = std::clamp(part, 0.0, 1.0);
  return std::hypot(segment.from[0] + part * ex - point[0], segment.from[1] + part * ez - point[1]);
}

TEST_P(SensorTopics, RaysEndOnTheTerrainOrMeetNothing) {
  Scene scene;
  std::size_t hits = 0;
  std::size_t misses = 0;
  for_each_state(120, [&](const State& state) {
    if (state.transition.step == 0) twin_.environment().scene(scene);
    const std::vector<Segment> terrain = surfaces(scene);
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
      if (std::abs(expected - double{state.scan.range_max}) < 1e-3) continue;  // either is right
      const double range = double{state.scan.ranges[i]};
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
  });
  EXPECT_GT(hits, 100U);
  EXPECT_GT(misses, 20U);
}

// ------------------------------------------------------------------ plain numbers

TEST_P(SensorTopics, RewardAndObservationAreThoseOfTheTransition) {
  Inbox<std_msgs::Float64MultiArray> observations(node_, topic("observation"));
  Inbox<std_msgs::Float64> rewards(node_, topic("reward"));
  for_each_state(45, [&](const State& state) {
    EXPECT_TRUE(observations.find([&](const std_msgs::Float64MultiArray& message) {
      return bits(message.data) == bits(state.transition.observation);
    })) << "step "
        << state.transition.step;
    EXPECT_TRUE(rewards.find([&](const std_msgs::Float64& message) {
      return bits({message.data}) == bits({state.transition.reward});
    })) << "step "
        << state.transition.step;
  });
}

INSTANTIATE_TEST_SUITE_P(Servers, SensorTopics,
                         testing::Values(Server{"", "", "BipedalWalker-v3", 0},
                                         Server{"/hardcore", "rough/", "BipedalWalkerHardcore-v3",
                                                3}),
                         [](const testing::TestParamInfo<Server>& info) {
                           return info.index == 0 ? "plain" : "hardcore";
                         });

}  // namespace
}  // namespace walker::test

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "sensors_test");
  ros::AsyncSpinner spinner(1);
  spinner.start();
  return RUN_ALL_TESTS();
}
