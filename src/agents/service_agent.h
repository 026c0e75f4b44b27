// Drives a lock-step server by its services ~reset and ~step.
#pragma once

#include <memory>
#include <string>

#include <ros/node_handle.h>
#include <ros/service_client.h>

#include "agents/options.h"
#include "core/pacer.h"
#include "walker_sim/Transition.h"
#include "walker_sim/agent.h"

namespace walker {

/// Repeats reset, then observe and step until the episode ends.
class ServiceAgent {
 public:
  /// Waits for the server. @throws std::invalid_argument when the agent does not fit it
  explicit ServiceAgent(AgentOptions options);

  /// Plays the episodes that the options ask for, or until the node is told to stop.
  /// A server that goes away is waited for; its interrupted episode does not count.
  void run();

 private:
  bool connect();
  bool play_episode();
  bool reset(std::optional<std::uint64_t> seed);
  bool step(const std::vector<double>& action);
  template <typename Service>
  bool make(ros::ServiceClient& client, Service& call);
  void wait_for_next_step();

  AgentOptions options_;
  ros::NodeHandle node_;
  ros::ServiceClient reset_client_;
  ros::ServiceClient step_client_;
  std::unique_ptr<Agent> agent_;
  std::unique_ptr<Pacer> pacer_;
  walker_sim::Transition transition_;
  std::size_t finished_ = 0;
};

}  // namespace walker
