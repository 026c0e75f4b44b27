// A robot for agents to drive: it publishes sensors and records commands. Its body is an
// environment in this process.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <std_msgs/Float64MultiArray.h>

#include "agents/options.h"
#include "agents/sensor_topics.h"
#include "server/inbox.h"
#include "server/topics/converters.h"
#include "server/twin.h"
#include "walker_sim/registry.h"

namespace walker::test {

/// Makes the agent of a node with this ~agent: heuristic, or policy, which is the shipped one.
inline std::unique_ptr<Agent> make_node_agent(const std::string& name,
                                              const Specification& specification) {
  AgentOptions options{};
  options.agent = name;
  return make_agent(options, specification, {});
}

struct Messages {
  sensor_msgs::JointState joints;
  sensor_msgs::Imu imu;
  nav_msgs::Odometry odometry;
  walker_sim::Contacts contacts;
  sensor_msgs::LaserScan scan;
};

/// Reverses names and lists, and prepends an unknown joint.
template <typename... Lists>
void shuffle(std::vector<std::string>& names, Lists&... lists) {
  std::reverse(names.begin(), names.end());
  names.insert(names.begin(), "neck");
  (std::reverse(lists.begin(), lists.end()), ...);
  (lists.insert(lists.begin(), 1), ...);
}

class Robot {
 public:
  /// @param agent the agent expected to answer the sensors: heuristic or policy
  Robot(const std::string& space, const std::string& id, const std::string& command,
        const std::string& agent = "heuristic")
      : node_(space),
        body_(id),
        builder_(make_observation_builder(id)),
        mind_(make_node_agent(agent, specification())),
        joints_(node_.advertise<sensor_msgs::JointState>("joint_states", 10)),
        imu_(node_.advertise<sensor_msgs::Imu>("imu", 10)),
        odometry_(node_.advertise<nav_msgs::Odometry>("odom", 10)),
        contacts_(node_.advertise<walker_sim::Contacts>("contacts", 10)),
        scan_(node_.advertise<sensor_msgs::LaserScan>("scan", 10)),
        episodes_(node_.advertise<walker_sim::Episode>("episode", 10)),
        commands_(node_, command) {
    body_.reset(3);
    stamp_ += ros::Duration(specification().dt);
    const auto give_up = std::chrono::steady_clock::now() + kPatience;
    while (!is_heard() && std::chrono::steady_clock::now() < give_up) {
      ros::WallDuration(0.005).sleep();
    }
  }

  const Specification& specification() { return body_.environment().specification(); }
  /// Steps the body by the agent's expected action and updates the sensor messages.
  void move() {
    if (!expected_.empty()) body_.step(action_);
    if (body_.has_ended()) body_.reset(3);
    stamp_ += ros::Duration(specification().dt);
    messages = {};
    const Frames frames(specification(), "");
    to_message(specification(), body_.sense(), stamp_, messages.joints);
    to_message(body_.sense(), frames, stamp_, messages.imu);
    to_message(body_.sense(), frames, stamp_, messages.odometry);
    to_message(specification(), body_.sense(), frames, stamp_, messages.contacts);
    if (has_scan()) to_message(specification(), body_.sense(), frames, stamp_, messages.scan);
    take(messages.joints, specification(), measurements_);
    take(messages.imu, specification(), measurements_);
    take(messages.odometry, specification(), measurements_);
    take(messages.contacts, specification(), measurements_);
    if (has_scan()) take(messages.scan, specification(), measurements_);
    shuffle(messages.joints.name, messages.joints.position, messages.joints.velocity,
            messages.joints.effort);
    shuffle(messages.contacts.links, messages.contacts.in_contact);
  }

  void publish(bool with_scan = true) {
    joints_.publish(messages.joints);
    imu_.publish(messages.imu);
    odometry_.publish(messages.odometry);
    contacts_.publish(messages.contacts);
    if (has_scan() && with_scan) scan_.publish(messages.scan);
  }

  void tell(std::uint32_t episode, std::uint32_t length, const std::string& end_reason) {
    walker_sim::Episode message;
    message.header.stamp = stamp_;
    message.episode = episode;
    message.length = length;
    message.end_reason = end_reason;
    episodes_.publish(message);
  }

  /// Resets the expected agent, as the node does at the start of an episode.
  void begin_anew() {
    builder_->reset();
    mind_->reset();
  }

  const std::vector<double>& think() {
    std::vector<double> observation(specification().observation_size());
    builder_->build(measurements_, observation.data());
    action_ = mind_->act(observation);
    expected_ = action_;
    for (std::size_t i = 0; i < expected_.size(); ++i) {
      expected_[i] *= specification().effort_per_action[i];
    }
    return expected_;
  }

  testing::AssertionResult is_answered() {
    const auto command = commands_.find(
        [this, place = std::size_t{0}](const std_msgs::Float64MultiArray& /*message*/) mutable {
          return place++ == read_;
        });
    if (!command) return testing::AssertionFailure() << "no command " << read_;
    ++read_;
    if (bits(command->data) == bits(expected_)) return testing::AssertionSuccess();
    return testing::AssertionFailure() << "command " << read_ - 1 << " is another one";
  }

  /// Whether no command arrives within 0.2 s, ten times an agent's response time.
  bool is_left_unanswered() {
    ros::WallDuration(0.2).sleep();
    return commands_.messages().size() == read_;
  }

  void play(int steps) {
    for (int i = 0; i < steps; ++i) {
      move();
      publish();
      think();
      ASSERT_TRUE(is_answered()) << "after " << i << " steps";
    }
  }

  Messages messages;

 private:
  bool has_scan() { return specification().range_finder.is_observed; }

  bool is_heard() {
    const std::vector<const ros::Publisher*> all{&joints_, &imu_, &odometry_, &contacts_,
                                                 &episodes_};
    return std::all_of(all.begin(), all.end(),
                       [](const ros::Publisher* one) { return one->getNumSubscribers() > 0; }) &&
           (!has_scan() || scan_.getNumSubscribers() > 0);
  }

  ros::NodeHandle node_;
  Twin body_;
  std::unique_ptr<ObservationBuilder> builder_;
  std::unique_ptr<Agent> mind_;
  Measurements measurements_;
  std::vector<double> action_;
  std::vector<double> expected_;
  static inline ros::Time stamp_{1000};  // increases over all tests
  std::size_t read_ = 0;                 // commands compared so far
  ros::Publisher joints_;
  ros::Publisher imu_;
  ros::Publisher odometry_;
  ros::Publisher contacts_;
  ros::Publisher scan_;
  ros::Publisher episodes_;
  Inbox<std_msgs::Float64MultiArray> commands_;
};

}  // namespace walker::test
