// What decides: an observation in, an action out.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "walker_sim/export.h"
#include "walker_sim/specification.h"

namespace walker {

/// A policy with memory over one episode. Not thread-safe.
class WALKER_SIM_EXPORT Agent {
 public:
  Agent() = default;
  Agent(const Agent&) = delete;
  Agent& operator=(const Agent&) = delete;
  virtual ~Agent() = default;

  /// A new episode begins.
  virtual void reset() = 0;

  /// @param observation as the environment's specification describes it
  /// @return float32 values within the action's bounds, valid until the next call
  virtual const std::vector<double>& act(const std::vector<double>& observation) = 0;
};

/// @param name "heuristic" (the gait that comes with the environment) or "random" (uniform within
///             the bounds)
/// @param seed of the random agent
/// @throws std::invalid_argument naming the agent and what is allowed
WALKER_SIM_EXPORT std::unique_ptr<Agent> make_agent(const std::string& name,
                                                    const Specification& specification,
                                                    std::uint64_t seed);

}  // namespace walker
