// The topic agent on a robot: no server, no /clock, reordered and additional joints, differing
// stamps, failing sensors.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <ros/ros.h>
#include <rosgraph_msgs/Log.h>

#include "agents/robot.h"

namespace walker::test {
namespace {

/// Each test begins a new episode; one agent process serves all tests.
class RobotTest : public testing::Test {
 protected:
  void SetUp() override {
    robot_.tell(++episode_, 0, "");
    ros::WallDuration(0.1).sleep();  // the announcement and the sensors use different connections
  }

  /// Publishes until the agent logs a warning that contains `words`, and for `more` longer.
  /// @return the number of these warnings
  static int warnings(const std::string& words, const std::function<void()>& publish,
                      std::chrono::seconds more = std::chrono::seconds(2)) {
    ros::NodeHandle node;
    Inbox<rosgraph_msgs::Log> log(node, "/rosout");
    const auto is_it = [&](const rosgraph_msgs::Log& message) {
      return message.level == rosgraph_msgs::Log::WARN &&
             message.msg.find(words) != std::string::npos;
    };
    const auto count = [&] {
      const std::vector<rosgraph_msgs::Log> all = log.messages();
      return static_cast<int>(std::count_if(all.begin(), all.end(), is_it));
    };
    const auto give_up = std::chrono::steady_clock::now() + kPatience;
    auto end = give_up;
    while (std::chrono::steady_clock::now() < end) {
      publish();
      ros::WallDuration(0.01).sleep();
      if (end == give_up && count() > 0) end = std::chrono::steady_clock::now() + more;
    }
    return count();
  }

  static inline std::uint32_t episode_ = 0;  // of all tests
  Robot robot_{"/exact", "BipedalWalker-v3", "legs_controller/command"};
};

TEST_F(RobotTest, IsDrivenByTheHeuristic) { robot_.play(200); }

TEST_F(RobotTest, IsDrivenByThePolicy) {
  Robot robot("/policy", "Walker2d-v5", "effort_command", "policy");
  robot.play(200);
}

TEST_F(RobotTest, StampsMayDifferWithinTheTolerance) {
  Robot robot("/apart", "Walker2d-v5", "effort_command");
  for (int i = 0; i < 200; ++i) {
    robot.move();
    robot.messages.imu.header.stamp += ros::Duration(0.002);
    robot.messages.contacts.header.stamp -= ros::Duration(0.0009);
    robot.publish();
    robot.think();
    ASSERT_TRUE(robot.is_answered()) << "step " << i;
  }
}

TEST_F(RobotTest, StampsBeyondTheToleranceAreReported) {
  Robot robot("/apart", "Walker2d-v5", "effort_command");
  const int said = warnings("stamp_tolerance = 0.003 s", [&robot] {
    robot.move();
    robot.messages.imu.header.stamp += ros::Duration(0.004);
    robot.publish();
  });
  EXPECT_GT(said, 1);
  EXPECT_TRUE(robot.is_left_unanswered());
}

TEST_F(RobotTest, ALateEpisodeMessageResetsTheAgent) {
  robot_.play(30);
  robot_.move();
  robot_.publish();
  const std::vector<double> continued = robot_.think();
  ASSERT_TRUE(robot_.is_answered());
  robot_.tell(++episode_, 0, "");
  robot_.begin_anew();
  EXPECT_NE(robot_.think(), continued) << "else it could not be seen";
  EXPECT_TRUE(robot_.is_answered());
  robot_.play(30);
}

TEST_F(RobotTest, ARestoredEpisodeResetsTheAgent) {
  robot_.play(30);
  robot_.move();
  robot_.tell(++episode_, 17, "");
  ros::WallDuration(0.1).sleep();
  robot_.publish();
  const std::vector<double> continued = robot_.think();
  robot_.begin_anew();
  EXPECT_NE(robot_.think(), continued) << "else it could not be seen";
  EXPECT_TRUE(robot_.is_answered());
  robot_.play(30);
}

TEST_F(RobotTest, NoCommandBetweenEpisodes) {
  robot_.play(10);
  robot_.tell(episode_, 10, "terminated: hull touched the ground");
  ros::WallDuration(0.1).sleep();
  robot_.move();
  robot_.publish();
  EXPECT_TRUE(robot_.is_left_unanswered());
  robot_.tell(++episode_, 0, "");
  robot_.begin_anew();
  robot_.think();
  EXPECT_TRUE(robot_.is_answered()) << "what came before the word that the episode begins";
  robot_.play(10);
}

TEST_F(RobotTest, NoCommandForOlderMeasurements) {
  robot_.play(10);
  robot_.move();
  const Messages old = robot_.messages;
  robot_.move();
  const Messages first = robot_.messages;
  robot_.tell(++episode_, 0, "");
  ros::WallDuration(0.1).sleep();
  robot_.messages = old;
  robot_.publish();
  EXPECT_TRUE(robot_.is_left_unanswered());
  robot_.messages = first;
  robot_.publish();
  robot_.begin_anew();
  robot_.think();
  EXPECT_TRUE(robot_.is_answered());
}

TEST_F(RobotTest, AMissingTopicIsReportedOncePerSecond) {
  const int said = warnings("no messages on /exact/scan", [this] {
    robot_.move();
    robot_.publish(false);
  });
  EXPECT_GE(said, 2);
  EXPECT_LE(said, 4);
  EXPECT_TRUE(robot_.is_left_unanswered());
  robot_.play(10);
}

TEST_F(RobotTest, MalformedMessagesAreReported) {
  using Change = std::function<void(Messages&)>;
  const std::vector<std::pair<std::string, Change>> cases{
      {"position of joint knee_2 is missing",
       [](Messages& m) { m.joints.name[1] = "wheel"; }},  // knee_2: the names are reversed
      {"velocity of joint hip_1 has no value", [](Messages& m) { m.joints.velocity.clear(); }},
      {"orientation is missing", [](Messages& m) { m.imu.orientation_covariance[0] = -1; }},
      {"angular_velocity is missing",
       [](Messages& m) { m.imu.angular_velocity_covariance[0] = -1; }},
      {"link lower_leg_2 is missing", [](Messages& m) { m.contacts.links[1] = "arm"; }},
      {"angle_min = 0.000000 rad", [](Messages& m) { m.scan.angle_min = 0; }},
      {"ranges has 3 values; must have 10", [](Messages& m) { m.scan.ranges.resize(3); }},
      {"must be a unit quaternion", [](Messages& m) { m.imu.orientation.w = 5; }},
      {"joint_position[0] (hip_1) = nan",
       [](Messages& m) { m.joints.position.back() = std::nan(""); }}};
  for (const auto& [words, change] : cases) {
    const auto publish = [this, change = change] {
      robot_.move();
      change(robot_.messages);
      robot_.publish();
    };
    EXPECT_GE(warnings(words, publish, std::chrono::seconds(0)), 1) << words;
  }
  EXPECT_TRUE(robot_.is_left_unanswered());
  robot_.play(10);
}

}  // namespace
}  // namespace walker::test
