// Options of the nodes that drive a walker: which agent, and how many episodes.
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
#include "walker_sim/world.h"

namespace walker {

/// Values of the nodes' private parameters.
struct AgentOptions {
  std::string agent;                 ///< ~agent: policy, heuristic or random
  std::string policy;                ///< ~policy: policy file, shipped or robust; empty: either
  std::string server;                ///< ~server: the server's name, relative to the namespace
  std::string env;                   ///< ~env: id of the environment; empty: the server's
  std::vector<std::uint64_t> seeds;  ///< ~seeds: used in turn; empty: none are sent
  std::uint64_t agent_seed;          ///< ~agent_seed: seed of the random agent
  std::uint32_t episodes;            ///< ~episodes: number of episodes; 0: no limit
  double real_time_factor;           ///< ~real_time_factor: pace of a lock-step agent; 0: unlimited
  double stamp_tolerance;            ///< ~stamp_tolerance: between stamps of one instant [s]

  /// Seed of the episode after `finished` ones; none: the server's generator continues.
  std::optional<std::uint64_t> seed_after(std::size_t finished) const;
};

std::vector<ParameterDescription> agent_parameters();

/// @throws std::invalid_argument naming the parameter, its value and what is allowed
AgentOptions read_agent_options();

/// Makes the agent that the options choose. Without a choice of a policy it is the shipped one or,
/// in a world other than Gymnasium's, the robust one if the package has it.
/// @throws std::invalid_argument if an option is invalid, or the agent does not fit the environment
std::unique_ptr<Agent> make_agent(const AgentOptions& options, const Specification& specification,
                                  const World& world);

}  // namespace walker
