// Recorded topics of walking and resting robots, for sensor_topics_test.cpp.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "robots/bipedal_walker/heuristic.h"
#include "server/player.h"

namespace walker::test {

/// A frame and its parent, named as in docs/ros_interface.md.
struct Edge {
  const char* parent;
  const char* child;
};

struct Robot {
  std::vector<const char*> links;    // the trunk first
  std::vector<const char*> parents;  // of the other links
  std::vector<std::string> joints;   // of the other links
  std::vector<std::string> feet;
  std::vector<Edge> tree;                                   // all transforms of a message on /tf
  double (*angle)(const std::vector<double>& observation);  // of the trunk, about -y [rad]
  double dt;                                                // [s]
  double gravity;                                           // [m/s^2]
  double tolerance;                                         // of poses [m, rad]
  double force_tolerance;                                   // [m/s^2]
  double rest_tolerance;                                    // [m/s^2]
};

/// A server in sensor_topics_test.test, and how to drive it.
struct Walk {
  const char* name;
  Server server;
  const Robot* robot;
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
