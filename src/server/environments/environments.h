// What a server holds: one environment or many, and which of them is shown. No ROS.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/environments/shown_environment.h"
#include "server/environments/simulation.h"
#include "server/parameter_reader.h"
#include "walker_sim/pool.h"
#include "walker_sim/renderer.h"

namespace walker {

/// The environments of a server, stepped together.
class Environments {
 public:
  Environments() = default;
  Environments(const Environments&) = delete;
  Environments& operator=(const Environments&) = delete;
  virtual ~Environments() = default;

  virtual std::size_t size() const = 0;
  virtual ShownEnvironment& shown() = 0;

  /// The only environment.
  /// @param service which wants it
  /// @throws std::logic_error where there are many, naming the service and what to call instead
  virtual Simulation& only(const std::string& service) = 0;

  /// Begins episodes. Where an engine fails, its environment's has ended with that, and the others
  /// are as ever.
  /// @param environments which, each at most once, below `size()`; rows of others stay as they are
  ///                     and rewards and flags may be null
  /// @param seeds one per listed environment, or empty; where there is none the generator
  ///              continues, and a first reset takes the server's seed + the environment's index
  virtual void reset(const std::vector<std::uint32_t>& environments,
                     const std::vector<std::optional<std::uint64_t>>& seeds, const Batch& rows) = 0;

  /// Steps every environment once, or resets it where the autoreset mode is next_step and its
  /// episode has ended. In the mode same_step who calls resets those whose episodes ended, so that
  /// their last state can be looked at before; where that reset failed, the next step resets.
  /// @param actions size() x action size
  /// @throws InvalidAction, ResetNeeded; then nothing has moved
  virtual void step(const std::vector<double>& actions, const Batch& rows) = 0;

  /// Takes down what an environment is like now.
  /// @param index below `size()`
  /// @throws ResetNeeded where it has no episode, or its simulation failed
  virtual void look(std::size_t index, Instant& instant) = 0;

  /// Sum of the rewards of the environment's present episode, or of one that has just ended.
  virtual double episode_return(std::size_t index) const = 0;
  /// Why the simulation had to end an episode that has just ended, in a step or at its reset;
  /// empty: it had not to.
  virtual std::string error(std::size_t index) const = 0;
};

/// A simulation for one environment, a pool for many.
/// @param make makes each of them, all alike
std::unique_ptr<Environments> make_environments(
    const ServerOptions& options, const std::function<std::unique_ptr<Environment>()>& make);

}  // namespace walker
