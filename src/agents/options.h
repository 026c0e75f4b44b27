// What the agent nodes' private parameters choose.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "walker_sim/Reset.h"
#include "walker_sim/parameters.h"

namespace walker {

struct AgentOptions {
  std::string agent;                 ///< ~agent: heuristic or random
  std::string server;                ///< ~server: the server's name, relative to the namespace
  std::string env;                   ///< ~env: id of the environment; empty: the server is asked
  std::vector<std::uint64_t> seeds;  ///< ~seeds: of the episodes, in turn; empty: the server's own
  std::uint64_t agent_seed;          ///< ~agent_seed: of the random agent
  std::uint32_t episodes;            ///< ~episodes: how many; 0: no end
  double real_time_factor;  ///< ~real_time_factor: of a lock-step agent; 0: as fast as it goes
  double stamp_tolerance;   ///< ~stamp_tolerance: of sensors' stamps of one instant [s]

  /// The request that begins the episode after `finished` ones.
  walker_sim::Reset::Request reset_after(std::size_t finished) const;
};

/// What the agent nodes take.
std::vector<ParameterDescription> agent_parameters();

/// @throws std::invalid_argument naming the parameter, its value and what is allowed
AgentOptions read_agent_options();

}  // namespace walker
