// Frames, signs and units of Walker2d's topics, against the in-process state and against geometry
// computed independently. The links' TF must also agree with the robot description.
#include <gtest/gtest.h>
#include <urdf/model.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <random>
#include <string>
#include <vector>

#include <ros/ros.h>

#include "description/description_transforms.h"
#include "server/player.h"
#include "server/tf_geometry.h"

namespace walker::test {
namespace {

constexpr double kTolerance = 1e-12;  // TF rounds about ten times [m, rad]
constexpr double kGravity = 9.81;     // [m/s^2]
constexpr double kDt = 0.008;         // [s]
constexpr std::array<const char*, 7> kLinks{"torso",      "thigh",    "leg",      "foot",
                                            "thigh_left", "leg_left", "foot_left"};
constexpr std::array<const char*, 6> kParents{"torso", "thigh",      "leg",
                                              "torso", "thigh_left", "leg_left"};
// Child frames of joints to which a link's own frame is fixed.
constexpr std::array<const char*, 4> kHinges{"leg_hinge", "foot_hinge", "leg_left_hinge",
                                             "foot_left_hinge"};
const std::vector<std::string> kJoints{"thigh_joint",      "leg_joint",      "foot_joint",
                                       "thigh_left_joint", "leg_left_joint", "foot_left_joint"};

/// A server in walker2d_topics_test.test, and how to drive it.
struct Case {
  const char* name;
  Server server;
  int episodes;  // with random actions
  int steps;     // at most, per episode
  int idle;      // steps with zero torque afterwards
};

struct Recording {
  std::vector<State> states;
  tf2_msgs::TFMessage fixed;  // /tf_static
};

Recording make_recording(const Case& recorded) {
  Player player(recorded.server);
  std::mt19937 draws(1);
  std::uniform_real_distribution<double> uniform(-1.5, 1.5);  // some out of bounds
  for (int episode = 0; episode < recorded.episodes; ++episode) {
    player.reset(static_cast<std::uint64_t>(episode));
    for (int i = 0; i < recorded.steps && !player.twin().has_ended(); ++i) {
      std::vector<double> action(kJoints.size());
      for (double& value : action) value = double{static_cast<float>(uniform(draws))};
      player.step(action);
      if (testing::Test::HasFatalFailure()) return {};
    }
  }
  for (int i = 0; i < recorded.idle; ++i) player.step(std::vector<double>(kJoints.size()));
  Recording recording;
  recording.states = player.take_states();
  ros::NodeHandle node;
  Inbox<tf2_msgs::TFMessage> fixed(node, "/tf_static");
  const std::string base_link = frame(recorded.server, "base_link");
  const auto constants = fixed.find([&](const tf2_msgs::TFMessage& message) {
    return !transforms_to(base_link, message).empty();
  });
  EXPECT_TRUE(constants) << "/tf_static tells nothing of " << base_link;
  recording.fixed = constants.value_or(tf2_msgs::TFMessage());
  return recording;
}

const Recording& recording_of(const Case& recorded) {
  static std::map<std::string, Recording> recordings;
  const auto known = recordings.find(recorded.name);
  if (known != recordings.end()) return known->second;
  return recordings.emplace(recorded.name, make_recording(recorded)).first->second;
}

class Walker2dTopics : public testing::TestWithParam<Case> {
 protected:
  void SetUp() override {
    recording_ = &recording_of(GetParam());
    ASSERT_GT(states().size(), 100U);
  }

  const std::vector<State>& states() const { return recording_->states; }
  const tf2_msgs::TFMessage& constants() const { return recording_->fixed; }
  static std::string frame(const std::string& name) { return test::frame(GetParam().server, name); }

  tf2::Transform look_up(const State& state, const std::string& parent,
                         const std::string& child) const {
    return test::look_up(state.transforms, frame(parent), frame(child), recording_->fixed);
  }

  /// The torso's angle about +y [rad].
  static double pitch(const State& state) { return state.transition.observation[1]; }

 private:
  const Recording* recording_ = nullptr;
};

TEST_P(Walker2dTopics, TfOfEveryLinkIsItsBody) {
  for (const State& state : states()) {
    for (std::size_t i = 0; i < kLinks.size(); ++i) {
      const tf2::Transform pose = look_up(state, "odom", kLinks[i]);
      const Pose& body = state.truth.link_poses[i];
      EXPECT_LT(pose.getOrigin().distance(to_tf(body.position)), kTolerance) << kLinks[i];
      EXPECT_LT(angle_between(pose.getRotation(), to_tf(body.orientation)), kTolerance)
          << kLinks[i];
    }
  }
}

TEST_P(Walker2dTopics, TfTurnsTheTorsoAboutYAndItsJointsAboutMinusY) {
  double steepest = 0;
  for (const State& state : states()) {
    const tf2::Quaternion attitude = look_up(state, "odom", "torso").getRotation();
    EXPECT_LT(angle_between(attitude, about_minus_y(-pitch(state))), kTolerance);
    steepest = std::max(steepest, std::abs(pitch(state)));
    for (std::size_t i = 0; i < kJoints.size(); ++i) {
      const tf2::Quaternion turn = look_up(state, kParents[i], kLinks[i + 1]).getRotation();
      const tf2::Quaternion expected = about_minus_y(state.joints.position[i]);
      EXPECT_LT(angle_between(turn, expected), kTolerance) << kJoints[i];
    }
  }
  EXPECT_GT(steepest, 0.3) << "else this test could not tell the signs apart";
}

TEST_P(Walker2dTopics, OneMessageTellsOfAllLinksByTheRobotDescription) {
  urdf::Model description;
  ASSERT_TRUE(description.initParam("/robot_description"));  // fits both models
  for (const State& state : states()) {
    const auto& all = state.transforms.transforms;
    ASSERT_EQ(all.size(), 1 + kJoints.size());
    EXPECT_EQ(all.front().header.frame_id, frame("odom"));
    EXPECT_EQ(all.front().child_frame_id, frame("torso"));
    for (const auto& transform : all) {
      EXPECT_EQ(transform.header.stamp, state.joints.header.stamp);
    }
    std::map<std::string, double> angles;
    for (std::size_t i = 0; i < kJoints.size(); ++i) {
      angles[state.joints.name[i]] = state.joints.position[i];
    }
    expect_the_kinematics_of(description, frame(""), angles, state.transforms, constants(),
                             kTolerance);
    if (HasFailure()) return;
  }
}

TEST_P(Walker2dTopics, OnlyMountsAndTheTrunksOtherNameAreFixed) {
  ASSERT_EQ(constants().transforms.size(), 1 + kHinges.size());
  for (const char* hinge : kHinges) {
    const std::string name = hinge;
    const auto found = transforms_to(frame(name.substr(0, name.rfind('_'))), constants());
    ASSERT_EQ(found.size(), 1U) << name;
    EXPECT_EQ(found[0].header.frame_id, frame(name));
  }
  const auto base_link = transforms_to(frame("base_link"), constants());
  ASSERT_EQ(base_link.size(), 1U);
  EXPECT_EQ(base_link[0].header.frame_id, frame("torso"));
}

TEST_P(Walker2dTopics, FramesAreThoseOfTheInterface) {
  for (const State& state : states()) {
    EXPECT_EQ(state.transition.header.frame_id, frame("odom"));
    EXPECT_EQ(state.odometry.header.frame_id, frame("odom"));
    EXPECT_EQ(state.odometry.child_frame_id, frame("torso"));
    EXPECT_EQ(state.imu.header.frame_id, frame("torso"));
    EXPECT_EQ(state.contacts.header.frame_id, frame("odom"));
  }
}

TEST_P(Walker2dTopics, EachStateIs8MillisecondsAfterTheLast) {
  for (std::size_t i = 1; i < states().size(); ++i) {
    const ros::Duration passed =
        states()[i].transition.header.stamp - states()[i - 1].transition.header.stamp;
    EXPECT_EQ(passed.toNSec(), 8'000'000);
  }
}

TEST_P(Walker2dTopics, JointStatesAreTheHingesWithTheActuatorsForce) {
  bool was_limited = false;
  for (const State& state : states()) {
    EXPECT_EQ(state.joints.name, kJoints);
    EXPECT_EQ(bits(state.joints.position), bits(state.truth.joint_position));
    EXPECT_EQ(bits(state.joints.velocity), bits(state.truth.joint_velocity));
    EXPECT_EQ(bits(state.joints.effort), bits(state.truth.joint_effort));
    const std::vector<double>& observation = state.transition.observation;
    std::vector<double> action = state.transition.action;
    if (state.transition.step == 0) action.assign(kJoints.size(), 0);
    for (std::size_t i = 0; i < kJoints.size(); ++i) {
      EXPECT_EQ(state.joints.position[i], observation[2 + i]) << kJoints[i];
      EXPECT_EQ(std::clamp(state.joints.velocity[i], -10.0, 10.0), observation[11 + i]);
      EXPECT_EQ(state.joints.effort[i], 100 * std::clamp(action[i], -1.0, 1.0)) << kJoints[i];
      was_limited = was_limited || std::abs(action[i]) > 1;
    }
  }
  EXPECT_TRUE(was_limited);
}

TEST_P(Walker2dTopics, OdometryIsOfTheTorsosOriginInItsOwnFrame) {
  for (const State& state : states()) {
    const std::vector<double>& observation = state.transition.observation;
    const nav_msgs::Odometry& odometry = state.odometry;
    const tf2::Quaternion attitude = to_tf(odometry.pose.pose.orientation);
    const tf2::Vector3 position = to_tf(odometry.pose.pose.position);
    EXPECT_LT(position.distance(to_tf(state.truth.link_poses.front().position)), kTolerance);
    EXPECT_NEAR(position.z(), observation[0], kTolerance);
    EXPECT_EQ(position.y(), 0);
    EXPECT_LT(angle_between(attitude, about_minus_y(-pitch(state))), kTolerance);
    const tf2::Vector3 velocity = tf2::quatRotate(attitude, to_tf(odometry.twist.twist.linear));
    const tf2::Vector3 turning = to_tf(odometry.twist.twist.angular);
    // The observation clips velocities to 10.
    EXPECT_NEAR(std::clamp(velocity.x(), -10.0, 10.0), observation[8], kTolerance);
    EXPECT_NEAR(velocity.y(), 0, kTolerance);
    EXPECT_NEAR(std::clamp(velocity.z(), -10.0, 10.0), observation[9], kTolerance);
    EXPECT_NEAR(std::clamp(turning.y(), -10.0, 10.0), observation[10], kTolerance);
    EXPECT_NEAR(std::hypot(turning.x(), turning.z()), 0, kTolerance);
  }
}

TEST_P(Walker2dTopics, ImuIsThatOfRep145) {
  tf2::Vector3 last_velocity(0, 0, 0);
  for (const State& state : states()) {
    const tf2::Quaternion attitude = to_tf(state.imu.orientation);
    EXPECT_LT(angle_between(attitude, to_tf(state.odometry.pose.pose.orientation)), kTolerance);
    EXPECT_LT(to_tf(state.imu.angular_velocity).distance(to_tf(state.odometry.twist.twist.angular)),
              kTolerance);
    EXPECT_NE(state.imu.orientation_covariance[0], -1) << "it has an orientation";
    // The IMU reports specific force, acceleration minus gravity, in the torso's frame.
    const tf2::Vector3 velocity =
        tf2::quatRotate(attitude, to_tf(state.odometry.twist.twist.linear));
    const tf2::Vector3 force = tf2::quatRotate(attitude, to_tf(state.imu.linear_acceleration));
    const tf2::Vector3 expected = (velocity - last_velocity) / kDt + tf2::Vector3(0, 0, kGravity);
    if (state.transition.step > 0) {
      EXPECT_LT(force.distance(expected), 1e-9) << "step " << state.transition.step;
    }
    last_velocity = velocity;
  }
}

TEST_P(Walker2dTopics, AtRestTheImuFeelsOneGravityUpwards) {
  if (GetParam().idle == 0) return;  // it is not at rest
  const sensor_msgs::Imu& imu = states().back().imu;
  const tf2::Quaternion attitude = to_tf(imu.orientation);
  const tf2::Vector3 force = tf2::quatRotate(attitude, to_tf(imu.linear_acceleration));
  EXPECT_NEAR(force.x(), 0, 0.05);
  EXPECT_NEAR(force.y(), 0, 1e-9);
  EXPECT_NEAR(force.z(), kGravity, 0.05);
  EXPECT_GT(std::abs(pitch(states().back())), 0.5) << "it was to lie on the ground";
}

/// Height of a foot's lowest point above the ground [m]. The foot is a capsule between (0, 0, 0.1)
/// and (-0.2, 0, 0.1) in its frame.
double clearance(const tf2::Transform& foot) {
  constexpr double kRadius = 0.06;
  return std::min((foot * tf2::Vector3(0, 0, 0.1)).z(), (foot * tf2::Vector3(-0.2, 0, 0.1)).z()) -
         kRadius;
}

TEST_P(Walker2dTopics, ContactsAreThoseOfTheFeet) {
  const std::vector<std::string> feet{"foot", "foot_left"};
  std::array<int, 2> counts{};
  for (const State& state : states()) {
    ASSERT_EQ(state.contacts.links, feet);
    ASSERT_EQ(state.contacts.in_contact.size(), 2U);
    for (std::size_t i = 0; i < feet.size(); ++i) {
      const double height = clearance(look_up(state, "odom", feet[i]));
      if (std::abs(height) < 1e-9) continue;  // rounding decides
      const bool touches = state.contacts.in_contact[i] != 0;
      EXPECT_EQ(touches, height < 0) << feet[i] << " is " << height << " m above the ground";
      ++counts[touches ? 1 : 0];
    }
  }
  EXPECT_GT(counts[0], 20) << "they never flew";
  EXPECT_GT(counts[1], 20) << "they never touched";
}

TEST_P(Walker2dTopics, InfoIsGymnasiumsAndAbsentValuesAreNotANumber) {
  const bool is_v5 = std::string(GetParam().server.id) == "Walker2d-v5";
  double last_x = 0;
  for (const State& state : states()) {
    const walker_sim::Transition& transition = state.transition;
    const std::vector<double>& info = transition.info;
    ASSERT_EQ(info.size(), is_v5 ? 6U : 2U);
    const double x = state.odometry.pose.pose.position.x;
    const double x_velocity = info[is_v5 ? 2 : 1];
    if (transition.step == 0) {
      EXPECT_EQ(std::isnan(info[0]), !is_v5);
      EXPECT_TRUE(std::isnan(x_velocity));
    } else {
      EXPECT_NEAR(info[0], x, kTolerance);
      EXPECT_NEAR(x_velocity, (x - last_x) / kDt, 1e-9);
    }
    if (is_v5) {
      EXPECT_NEAR(info[0], x, kTolerance);
      EXPECT_NEAR(info[1], transition.observation[0] - 1.25, kTolerance);
      EXPECT_EQ(std::isnan(info[3]), transition.step == 0);
      if (transition.step > 0) {
        EXPECT_NEAR(info[3] + info[4] + info[5], transition.reward, kTolerance);
      }
    }
    last_x = x;
  }
}

INSTANTIATE_TEST_SUITE_P(
    Servers, Walker2dTopics,
    testing::Values(Case{"v5", {"", "", "Walker2d-v5", {}}, 10, 1000, 0},
                    Case{
                        "v4_falling",
                        {"/falling", "left/", "Walker2d-v4", {{"terminate_when_unhealthy", false}}},
                        2,
                        150,
                        400}),
    [](const testing::TestParamInfo<Case>& of) { return of.param.name; });

}  // namespace
}  // namespace walker::test
