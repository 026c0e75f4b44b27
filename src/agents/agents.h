// The agents that drive a walker over ROS. Each plays the episodes that the options ask for, or
// until the node is told to stop.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "walker_sim/agent.h"
#include "walker_sim/parameters.h"
#include "walker_sim/specification.h"

namespace walker {

/// What the nodes' private parameters choose.
struct AgentOptions {
  std::string agent;                 ///< ~agent: policy, heuristic or random
  std::string policy;                ///< ~policy: its file; empty: the one that comes along
  std::string server;                ///< ~server: the server's name, relative to the namespace
  std::string env;                   ///< ~env: id of the environment; empty: the server is asked
  std::vector<std::uint64_t> seeds;  ///< ~seeds: of the episodes, in turn; empty: the server's own
  std::uint64_t agent_seed;          ///< ~agent_seed: of the random agent
  std::uint32_t episodes;            ///< ~episodes: how many; 0: no end
  double real_time_factor;  ///< ~real_time_factor: of a lock-step agent; 0: as fast as it goes
  double stamp_tolerance;   ///< ~stamp_tolerance: of sensors' stamps of one instant [s]

  /// Of the episode after `finished` ones; none: the server's generator goes on.
  std::optional<std::uint64_t> seed_after(std::size_t finished) const;
};

/// What the agent nodes take.
std::vector<ParameterDescription> agent_parameters();

/// @throws std::invalid_argument naming the parameter, its value and what is allowed
AgentOptions read_agent_options();

/// Who decides.
/// @throws std::invalid_argument when it does not fit the environment
std::unique_ptr<Agent> make_agent(const AgentOptions& options, const Specification& specification);

/// Drives a lock-step server by ~reset and ~step. A server that goes away is waited for; its
/// interrupted episode does not count.
/// @throws std::invalid_argument when the agent does not fit the server; std::runtime_error with
///         the server's words when it refuses
void drive_by_services(const AgentOptions& options);

/// Drives a free-running server, or a robot: answers what the sensors measure with an
/// `effort_command` [N m].
///
/// Where episodes begin and end it learns from `episode`; where nobody publishes that, as on a
/// robot, there is one without end. With seeds it begins each episode itself through ~reset;
/// without, the server does.
/// @throws std::invalid_argument when the agent does not fit the environment
void drive_by_topics(const AgentOptions& options);

}  // namespace walker
