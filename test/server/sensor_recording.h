// Topics of walking and resting robots, recorded together with the true states of an in-process
// twin.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <map>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <nav_msgs/Odometry.h>
#include <ros/message_traits.h>
#include <ros/node_handle.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/JointState.h>
#include <sensor_msgs/LaserScan.h>
#include <std_msgs/Float64.h>
#include <std_msgs/Float64MultiArray.h>
#include <tf2_msgs/TFMessage.h>

#include "robots/bipedal_walker/heuristic.h"
#include "server/inbox.h"
#include "server/remote.h"
#include "server/twin.h"
#include "walker_sim/Contacts.h"

namespace walker::test {

/// Messages that a server publishes about one state, and the true state.
struct State {
  walker_sim::Transition transition;
  sensor_msgs::JointState joints;
  sensor_msgs::LaserScan scan;  // empty if the walker has no range finder
  sensor_msgs::Imu imu;
  nav_msgs::Odometry odometry;
  walker_sim::Contacts contacts;
  tf2_msgs::TFMessage transforms;
  Sensors truth;
};

struct Server {
  const char* space;      // namespace of the node and its topics
  const char* tf_prefix;  // empty, or with a trailing slash
  const char* id;
  Parameters parameters;
};

inline std::string frame(const Server& server, const std::string& name) {
  return server.tf_prefix + name;
}

/// Drives a server and collects its messages and the true states.
class Player {
 public:
  explicit Player(const Server& server)
      : server_(server),
        remote_(server.space + std::string("/walker_sim")),
        twin_(server.id, server.parameters),
        joints_(node_, topic("joint_states")),
        imus_(node_, topic("imu")),
        odometries_(node_, topic("odom")),
        contacts_(node_, topic("contacts")),
        observations_(node_, topic("observation")),
        rewards_(node_, topic("reward")),
        transforms_(node_, "/tf") {
    if (specification().range_finder.num_rays != 0) scans_.emplace(node_, topic("scan"));
    // A publisher registers a subscriber later than the subscriber registers the publisher.
    wait_until([this] {
      remote_.reset(0);
      return hears_all();
    });
  }

  void reset(std::uint64_t seed) {
    twin_.reset(seed);
    collect(remote_.reset(seed));
  }

  void step(const std::vector<double>& action) {
    twin_.step(action);
    collect(remote_.step(action));
  }

  Twin& twin() { return twin_; }
  const Specification& specification() { return twin_.environment().specification(); }
  std::vector<State> take_states() { return std::exchange(states_, {}); }

 private:
  std::string topic(const std::string& name) const { return server_.space + ("/" + name); }

  bool has_trunk(const tf2_msgs::TFMessage& message) const {
    return message.transforms.front().header.frame_id == frame(server_, "odom");
  }

  bool hears_all() {
    const std::vector<tf2_msgs::TFMessage> all = transforms_.messages();
    const bool hears_transforms = std::any_of(
        all.begin(), all.end(), [this](const auto& message) { return has_trunk(message); });
    return hears_transforms && joints_.has_any() && (!scans_ || scans_->has_any()) &&
           imus_.has_any() && odometries_.has_any() && contacts_.has_any() &&
           observations_.has_any() && rewards_.has_any();
  }

  /// Waits for the messages about the transition's state.
  void collect(const walker_sim::Transition& transition) {
    ASSERT_TRUE(twin_.equals(transition));
    State state;
    state.transition = transition;
    state.truth = twin_.sense();
    const ros::Time stamp = transition.header.stamp;
    take(joints_.at(stamp), state.joints);
    if (scans_) take(scans_->at(stamp), state.scan);
    take(imus_.at(stamp), state.imu);
    take(odometries_.at(stamp), state.odometry);
    take(contacts_.at(stamp), state.contacts);
    // All servers publish /tf; the frame identifies this one.
    take(transforms_.find([&](const tf2_msgs::TFMessage& message) {
      return stamp_of(message) == stamp && has_trunk(message);
    }),
         state.transforms);
    // These two messages have no stamp.
    std_msgs::Float64MultiArray observation;
    take(observations_.find([&](const std_msgs::Float64MultiArray& message) {
      return bits(message.data) == bits(transition.observation);
    }),
         observation);
    std_msgs::Float64 reward;
    take(rewards_.find([&](const std_msgs::Float64& message) {
      return bits({message.data}) == bits({transition.reward});
    }),
         reward);
    states_.push_back(state);
  }

  template <typename Message>
  static void take(const std::optional<Message>& found, Message& place) {
    ASSERT_TRUE(found) << "no " << ros::message_traits::datatype<Message>() << " of this step";
    place = *found;
  }

  ros::NodeHandle node_;
  Server server_;
  Remote remote_;
  Twin twin_;
  Inbox<sensor_msgs::JointState> joints_;
  Inbox<sensor_msgs::Imu> imus_;
  Inbox<nav_msgs::Odometry> odometries_;
  Inbox<walker_sim::Contacts> contacts_;
  Inbox<std_msgs::Float64MultiArray> observations_;
  Inbox<std_msgs::Float64> rewards_;
  Inbox<tf2_msgs::TFMessage> transforms_;
  std::optional<Inbox<sensor_msgs::LaserScan>> scans_;
  std::vector<State> states_;
};

/// A frame and its parent, named as in docs/ros_interface.md.
struct Edge {
  const char* parent;
  const char* child;
};

struct ExpectedRobot {
  std::vector<const char*> links;    // the trunk first
  std::vector<const char*> parents;  // of the other links
  std::vector<std::string> joints;   // of the other links
  std::vector<std::string> feet;
  std::vector<Edge> tree;                                   // all transforms of a message on /tf
  double (*angle)(const std::vector<double>& observation);  // of the trunk, about -y [rad]
  double dt;                                                // [s]
  float range;                                              // of the lidar [m]
  double gravity;                                           // [m/s^2]
  double tolerance;                                         // of poses [m, rad]
  double force_tolerance;                                   // [m/s^2]
  double rest_tolerance;                                    // [m/s^2]
};

/// A server in sensor_topics_test.test, and how to drive it.
struct Walk {
  const char* name;
  Server server;
  const ExpectedRobot* robot;
  void (*walk)(Player& player);
  void (*rest)(Player& player);  // null if it does not come to rest
};

struct Recording {
  std::vector<State> walk;
  Scene scene;                // of the last episode of the walk
  std::vector<State> rest;    // the last state is at rest
  tf2_msgs::TFMessage fixed;  // /tf_static
};

inline void follow_heuristic(Player& player, std::uint64_t seed) {
  player.reset(seed);
  bipedal_walker::Heuristic heuristic;
  for (int i = 0; i < 120 && !player.twin().has_ended(); ++i) {
    std::vector<double> action(4);
    heuristic.act(player.twin().observation().data(), action.data());
    player.step(action);
    if (testing::Test::HasFatalFailure()) return;
  }
}

inline void act_at_random(Player& player, int episodes, int max_steps) {
  std::mt19937 draws(1);
  std::uniform_real_distribution<double> uniform(-1.5, 1.5);  // some out of bounds
  for (int episode = 0; episode < episodes; ++episode) {
    player.reset(static_cast<std::uint64_t>(episode));
    for (int i = 0; i < max_steps && !player.twin().has_ended(); ++i) {
      std::vector<double> action(player.specification().action_size());
      for (double& value : action) value = double{static_cast<float>(uniform(draws))};
      player.step(action);
      if (testing::Test::HasFatalFailure()) return;
    }
  }
}

inline void repeat(Player& player, int steps, const std::vector<double>& action) {
  for (int i = 0; i < steps && !testing::Test::HasFatalFailure(); ++i) player.step(action);
}

inline Recording make_recording(const Walk& walk) {
  Player player(walk.server);
  Recording recording;
  walk.walk(player);
  player.twin().environment().scene(recording.scene);
  recording.walk = player.take_states();
  if (walk.rest != nullptr) walk.rest(player);
  recording.rest = player.take_states();
  ros::NodeHandle node;
  Inbox<tf2_msgs::TFMessage> fixed(node, "/tf_static");
  const std::string base_link = frame(walk.server, "base_link");
  const auto found = fixed.find([&](const tf2_msgs::TFMessage& message) {
    const auto& all = message.transforms;
    return std::any_of(all.begin(), all.end(), [&](const auto& transform) {
      return transform.child_frame_id == base_link;
    });
  });
  EXPECT_TRUE(found) << "no " << base_link << " on /tf_static";
  recording.fixed = found.value_or(tf2_msgs::TFMessage());
  return recording;
}

inline const Recording& recording_of(const Walk& walk) {
  static std::map<std::string, Recording> recordings;
  const auto known = recordings.find(walk.name);
  if (known != recordings.end()) return known->second;
  return recordings.emplace(walk.name, make_recording(walk)).first->second;
}

}  // namespace walker::test
