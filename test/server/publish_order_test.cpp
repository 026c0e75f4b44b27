// /clock is published before the data with its stamp. Messages on two connections arrive in any
// order, so the server runs in this process, and a recorder replaces roscpp's Publisher::publish.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <string>
#include <thread>
#include <vector>

#include <nav_msgs/Odometry.h>
#include <ros/publisher.h>
#include <ros/ros.h>
#include <tf2_msgs/TFMessage.h>

#include "server/gate.h"
#include "server/inbox.h"
#include "server/remote.h"
#include "server/server.h"

namespace {

/// Topics in the order in which the server published them.
walker::test::Mailbox& record() {
  static walker::test::Mailbox the_record;
  return the_record;
}

}  // namespace

namespace ros {

// Overrides roscpp's definition, which every publish(message) calls.
void Publisher::publish(const boost::function<SerializedMessage()>& /*serialize*/,
                        SerializedMessage& /*message*/) const {
  record().add(getTopic());
}

}  // namespace ros

namespace walker::test {
namespace {

constexpr std::array<const char*, 3> kData{"/tf", "/odom", "/transition"};

class PublishOrder : public testing::Test {
 protected:
  PublishOrder()
      : server_(read_server_options()),
        loop_([this] { server_.run(); }),
        transforms_(node_, "/tf"),
        odometries_(node_, "odom"),
        transitions_(node_, "transition"),
        episodes_(node_, "episode"),
        remote_(ros::this_node::getName()) {
    // A publisher registers a subscriber later than the subscriber registers the publisher.
    wait_until([this] {
      // The pace saves up more states in this time than a reset takes.
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
      record().take();
      remote_.reset(0);
      const std::vector<std::string> topics = record().take();
      // /episode is latched, and published without subscribers too: then before /clock.
      return all_are_heard(topics) && topics.front() == "/clock";
    });
  }

  ~PublishOrder() override {
    ros::shutdown();
    loop_.join();
  }

  static bool all_are_heard(const std::vector<std::string>& topics) {
    return std::all_of(kData.begin(), kData.end(), [&](const char* data) {
      return std::find(topics.begin(), topics.end(), data) != topics.end();
    });
  }

  /// Expects /clock first, then each data topic, all exactly once since the last call.
  static void expect_clock_first() {
    const std::vector<std::string> topics = record().take();
    ASSERT_FALSE(topics.empty());
    EXPECT_EQ(topics.front(), "/clock");
    EXPECT_EQ(std::count(topics.begin(), topics.end(), "/clock"), 1);
    for (const char* data : kData) {
      EXPECT_EQ(std::count(topics.begin(), topics.end(), data), 1) << data;
    }
  }

  ros::NodeHandle node_;
  Server server_;
  std::thread loop_;
  Inbox<tf2_msgs::TFMessage> transforms_;
  Inbox<nav_msgs::Odometry> odometries_;
  Inbox<walker_sim::Transition> transitions_;
  Inbox<walker_sim::Episode> episodes_;
  Remote remote_;
};

TEST_F(PublishOrder, PublishesClockBeforeItsData) {
  for (std::uint64_t seed = 0; seed < 3; ++seed) {
    remote_.reset(seed);
    expect_clock_first();
    for (int i = 0; i < 10; ++i) {
      remote_.step({1, 1, -1, 1});
      expect_clock_first();
    }
  }

  // Beyond the pace of the other topics, each transition still has its time.
  constexpr int kResets = 3000;
  for (int i = 0; i < kResets; ++i) remote_.reset(0);
  std::string last;
  int transitions = 0;
  for (const std::string& topic : record().take()) {
    if (topic == "/transition") {
      EXPECT_EQ(last, "/clock") << "before its time";
      ++transitions;
    }
    if (topic == "/clock" || topic == "/transition") last = topic;
  }
  EXPECT_EQ(transitions, kResets);
}

}  // namespace
}  // namespace walker::test

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "publish_order_test");
  return RUN_ALL_TESTS();
}
