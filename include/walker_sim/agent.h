// The interface of agents, which map observations to actions.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "walker_sim/export.h"
#include "walker_sim/specification.h"

namespace walker {

/// A policy that may keep state within an episode. Not thread-safe.
class WALKER_SIM_EXPORT Agent {
 public:
  Agent() = default;
  Agent(const Agent&) = delete;
  Agent& operator=(const Agent&) = delete;
  virtual ~Agent() = default;

  /// Clears the per-episode state. Must be called at the beginning of each episode.
  virtual void reset() = 0;

  /// @param observation of the environment, `Specification::observation_size()` values
  /// @return float32 values within the action's bounds, valid until the next call
  virtual const std::vector<double>& act(const std::vector<double>& observation) = 0;
};

/// @param name "heuristic" (the environment's own gait) or "random" (uniform within the bounds)
/// @param seed seeds the random agent; "heuristic" ignores it
/// @throws std::invalid_argument if the name is unknown or the environment has no gait
WALKER_SIM_EXPORT std::unique_ptr<Agent> make_agent(const std::string& name,
                                                    const Specification& specification,
                                                    std::uint64_t seed);

}  // namespace walker
