// What a server's topics tell of an episode, each state beside the truth of a twin in this process.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <map>
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

#include "bipedal_walker/heuristic.h"
#include "server/inbox.h"
#include "server/remote.h"
#include "server/twin.h"
#include "walker_sim/Contacts.h"

namespace walker::test {

/// All that a server publishes of one state, and the truth.
struct State {
  walker_sim::Transition transition;
  sensor_msgs::JointState joints;
  sensor_msgs::LaserScan scan;
  sensor_msgs::Imu imu;
  nav_msgs::Odometry odometry;
  walker_sim::Contacts contacts;
  tf2_msgs::TFMessage transforms;
  Sensors truth;  // of the twin in this process
};

struct Server {
  const char* space;      // of the node and its topics
  const char* tf_prefix;  // as in sensors_test.test
  const char* id;
  std::uint64_t seed;  // an episode in which the heuristic lasts
};

inline std::string frame(const Server& server, const std::string& name) {
  return server.tf_prefix + name;
}

/// Drives a server and a twin by the same actions and collects what the topics tell.
class Player {
 public:
  explicit Player(const Server& server)
      : server_(server),
        remote_(server.space + std::string("/walker_sim")),
        twin_(server.id),
        joints_(node_, topic("joint_states")),
        scans_(node_, topic("scan")),
        imus_(node_, topic("imu")),
        odometries_(node_, topic("odom")),
        contacts_(node_, topic("contacts")),
        observations_(node_, topic("observation")),
        rewards_(node_, topic("reward")),
        transforms_(node_, "/tf") {
    // A publisher counts its subscribers a moment after they count it.
    const auto give_up = std::chrono::steady_clock::now() + kPatience;
    do {
      remote_.reset(0);
    } while (!hears_all() && std::chrono::steady_clock::now() < give_up);
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
  std::vector<State> take_states() { return std::exchange(states_, {}); }

 private:
  std::string topic(const std::string& name) const { return server_.space + ("/" + name); }

  bool hears_all() {
    const std::vector<tf2_msgs::TFMessage> transforms = transforms_.messages();
    const bool hears_transforms =
        std::any_of(transforms.begin(), transforms.end(), [&](const tf2_msgs::TFMessage& message) {
          return message.transforms.front().header.frame_id == frame(server_, "odom");
        });
    return hears_transforms && joints_.has_any() && scans_.has_any() && imus_.has_any() &&
           odometries_.has_any() && contacts_.has_any() && observations_.has_any() &&
           rewards_.has_any();
  }

  /// Waits for the messages with the transition's stamp.
  void collect(const walker_sim::Transition& transition) {
    ASSERT_TRUE(twin_.equals(transition));
    State state;
    state.transition = transition;
    state.truth = twin_.sense();
    const ros::Time stamp = transition.header.stamp;
    take(joints_.at(stamp), state.joints);
    take(scans_.at(stamp), state.scan);
    take(imus_.at(stamp), state.imu);
    take(odometries_.at(stamp), state.odometry);
    take(contacts_.at(stamp), state.contacts);
    // Both servers publish /tf, with stamps of their own.
    take(transforms_.find([&](const tf2_msgs::TFMessage& message) {
      return stamp_of(message) == stamp &&
             message.transforms.front().header.frame_id == frame(server_, "odom");
    }),
         state.transforms);
    // These two have no stamp.
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
    ASSERT_TRUE(found) << "nothing on " << ros::message_traits::datatype<Message>()
                       << " tells of this step";
    place = *found;
  }

  ros::NodeHandle node_;
  Server server_;
  Remote remote_;
  Twin twin_;
  Inbox<sensor_msgs::JointState> joints_;
  Inbox<sensor_msgs::LaserScan> scans_;
  Inbox<sensor_msgs::Imu> imus_;
  Inbox<nav_msgs::Odometry> odometries_;
  Inbox<walker_sim::Contacts> contacts_;
  Inbox<std_msgs::Float64MultiArray> observations_;
  Inbox<std_msgs::Float64> rewards_;
  Inbox<tf2_msgs::TFMessage> transforms_;
  std::vector<State> states_;
};

/// What the tests look at. Recorded once per server.
struct Recording {
  std::vector<State> walk;  // the heuristic's first steps
  Scene scene;              // in which it walks
  State rest;               // astride, after five seconds
};

inline Recording make_recording(const Server& server) {
  Player player(server);
  Recording recording;
  player.reset(server.seed);
  player.twin().environment().scene(recording.scene);
  bipedal_walker::Heuristic heuristic;
  for (int i = 0; i < 120 && !player.twin().has_ended(); ++i) {
    std::vector<double> action(4);
    heuristic.act(player.twin().observation().data(), action.data());
    player.step(action);
    if (testing::Test::HasFatalFailure()) return recording;
  }
  recording.walk = player.take_states();
  player.reset(1);
  for (int i = 0; i < 250; ++i) {
    player.step({1, 1, -1, 1});
    if (testing::Test::HasFatalFailure()) return recording;
  }
  recording.rest = player.take_states().back();
  return recording;
}

inline const Recording& recording_of(const Server& server) {
  static std::map<std::string, Recording> recordings;
  const auto known = recordings.find(server.id);
  if (known != recordings.end()) return known->second;
  return recordings.emplace(server.id, make_recording(server)).first->second;
}

}  // namespace walker::test
