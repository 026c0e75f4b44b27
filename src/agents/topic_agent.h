// Drives a free-running server by topics, as it would drive a robot.
#pragma once

#include <memory>
#include <optional>

#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <ros/subscriber.h>
#include <std_msgs/Float64MultiArray.h>

#include "agents/agent.h"
#include "agents/options.h"
#include "walker_sim/Transition.h"

namespace walker {

/// Answers every `transition` with an `effort_command`. With seeds it begins each episode itself
/// through ~reset; without, the server does.
class TopicAgent {
 public:
  /// Waits for the server. @throws std::invalid_argument when the agent does not fit it
  explicit TopicAgent(const AgentOptions& options);

  /// Answers until the node is told to stop or the episodes are over.
  void run();

 private:
  void wait_for_connections();
  void on_transition(const walker_sim::Transition& transition);
  void finish_episode(const walker_sim::Transition& transition);
  void reset(std::optional<std::uint64_t> seed);

  AgentOptions options_;
  ros::NodeHandle node_;
  std::optional<Specification> specification_;
  std::unique_ptr<Agent> agent_;
  ros::Publisher effort_publisher_;
  ros::Subscriber transition_subscriber_;
  std_msgs::Float64MultiArray efforts_;
  std::uint32_t episode_ = 0;  // that the agent is in; 0: none yet
  std::size_t finished_ = 0;
};

}  // namespace walker
