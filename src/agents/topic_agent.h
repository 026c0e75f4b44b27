// Drives a free-running server, or a robot, by topics.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <ros/subscriber.h>
#include <std_msgs/Float64MultiArray.h>

#include "agents/options.h"
#include "agents/sensor_topics.h"
#include "walker_sim/Episode.h"
#include "walker_sim/agent.h"
#include "walker_sim/observation_builder.h"

namespace walker {

/// Answers what the sensors measure with an `effort_command` [N m].
///
/// Where episodes begin and end it learns from `episode`; where nobody publishes that, as on a
/// robot, there is one without end. With seeds it begins each episode itself through ~reset;
/// without, the server does.
class TopicAgent {
 public:
  /// Waits for the server, unless the options name the environment.
  /// @throws std::invalid_argument when the agent does not fit the environment
  explicit TopicAgent(const AgentOptions& options);

  /// Answers until the node is told to stop or the episodes are over.
  void run();

 private:
  void wait_for_connections();
  void on_measurements(ros::Time stamp, const Measurements& measurements);
  void on_episode(const walker_sim::Episode& episode);
  void begin_episode(const walker_sim::Episode& episode);
  void finish_episode(const walker_sim::Episode& episode);
  void act();
  void reset(std::optional<std::uint64_t> seed);

  AgentOptions options_;
  ros::NodeHandle node_;
  std::optional<Specification> specification_;
  std::unique_ptr<Agent> agent_;
  std::unique_ptr<ObservationBuilder> builder_;
  std::vector<double> observation_;
  Measurements measurements_;  // the last
  ros::Time measured_at_;      // zero: there are none yet
  ros::Time begun_at_;         // what is older is not of the present episode
  bool has_ended_ = false;     // the present episode
  std::uint32_t episode_ = 0;  // the present one; 0: not told of any
  std::size_t finished_ = 0;
  std_msgs::Float64MultiArray efforts_;
  ros::Publisher effort_publisher_;
  std::unique_ptr<SensorTopics> sensors_;
  ros::Subscriber episode_subscriber_;
};

}  // namespace walker
