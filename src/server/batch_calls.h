// The pool of environments of a server: ~reset_batch, ~step_batch, and access to one of them.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "episode/walker.h"
#include "ros/throttle.h"
#include "server/parameter_reader.h"
#include "server/topics/statistics.h"
#include "walker_sim/GetWorlds.h"
#include "walker_sim/ResetBatch.h"
#include "walker_sim/SetWorld.h"
#include "walker_sim/StepBatch.h"
#include "walker_sim/pool.h"

namespace walker {

using walker_sim::ResetBatch;
using walker_sim::SetWorld;
using walker_sim::StepBatch;

using MakeEnvironment = std::function<std::unique_ptr<Environment>()>;

/// Makes a server's pool. Environment i begins with seed + i; the shown one records its actions.
Pool make_pool(const ServerOptions& options, const MakeEnvironment& make);

/// @throws std::logic_error if there are several, naming `service` and what to call instead
Walker& single_walker(Pool& pool, const char* service);

/// @throws std::invalid_argument naming `field` if the index is out of range
void check_environment(const Pool& pool, const std::string& field, std::uint32_t index);

/// Returns the world of the start, and the presets and parameters that the environment can apply.
walker_sim::GetWorlds::Response list_worlds(const ServerOptions& options,
                                            const Specification& specification);

/// Makes the calls and counts their outcomes. The pool writes rows directly into the response,
/// whose vectors may keep their capacity. An engine failure ends its own environment's episode, as
/// in a Pool, and is listed in the response's `failures`; `status_message` repeats it as text:
/// "environment 3: the simulation failed at its reset: Stack overflow".
class BatchCalls {
 public:
  /// @param pool, options, account outlive this
  BatchCalls(Pool& pool, const ServerOptions& options, Account& account);

  /// @throws std::invalid_argument naming the field, its value and what is allowed; then nothing
  ///         has changed
  void reset(const ResetBatch::Request& request, ResetBatch::Response& response);

  /// Sets the worlds of the resets to come. @throws as `reset`
  void set_worlds(const SetWorld::Request& request);

  /// Steps all environments.
  /// @param on_stepped as for `Pool::step`
  /// @throws as `Pool::step`; then the response has no meaning
  void step(
      const std::vector<double>& actions, StepBatch::Response& response,
      const std::function<void()>& on_stepped = [] {});

 private:
  const EpisodeState& state_of(std::uint32_t environment) const {
    return pool_.walker(environment).state();
  }
  void check_list(const std::vector<std::uint32_t>& listed) const;
  void set_requested(const std::vector<std::uint32_t>& listed,
                     const std::vector<walker_sim::World>& worlds);
  Batch rows_of(StepBatch::Response& response) const;
  void record_steps(const std::vector<double>& actions, StepBatch::Response& response);
  template <typename Response>
  void record(const EpisodeState& state, Response& response);
  template <typename Response>
  void record_failure(const EpisodeState& state, Response& response);

  Pool& pool_;
  const Specification& specification_;
  const ServerOptions& options_;
  Account& account_;
  std::vector<std::uint32_t> all_;    // indices
  std::vector<std::uint32_t> ended_;  // in the last step
  Throttle throttle_;
};

}  // namespace walker
