// ~reset_batch and ~step_batch: requests to the pool, and rows of the replies from it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "ros/throttle.h"
#include "server/environments.h"
#include "server/parameter_reader.h"
#include "server/topics/episode_statistics.h"
#include "walker_sim/ResetBatch.h"
#include "walker_sim/StepBatch.h"

namespace walker {

/// Makes the calls and counts what they did. Rows are written straight into the reply, whose
/// vectors may bring memory from an earlier call. An engine that fails ends the episode of its own
/// environment, as in a Pool, and stands in the reply's failures; status_message repeats it for
/// people: "environment 3: the simulation failed at its reset: Stack overflow".
class BatchCalls {
 public:
  /// What it is given outlives it.
  BatchCalls(Pool& pool, const ServerOptions& options, ServerCounters& counters,
             EpisodeStatistics& episodes);

  /// @throws std::invalid_argument naming the field, its value and what is allowed; then
  ///         nothing has moved
  void reset(const walker_sim::ResetBatch::Request& request,
             walker_sim::ResetBatch::Response& response);

  /// Steps all. Under same_step ended episodes stay as they are until `reset_ended`.
  /// @throws as `Pool::step`; then the reply has no meaning
  void step(const std::vector<double>& actions, walker_sim::StepBatch::Response& response);

  /// Begins the episodes that same_step wants after this step.
  void reset_ended(walker_sim::StepBatch::Response& response);

 private:
  const EpisodeState& state_of(std::uint32_t environment) const {
    return pool_.episode(environment).state();
  }
  void check(const walker_sim::ResetBatch::Request& request) const;
  Batch rows_of(walker_sim::StepBatch::Response& response) const;
  void account(const std::vector<double>& actions, walker_sim::StepBatch::Response& response);
  template <typename Response>
  void record_failure(const EpisodeState& state, Response& response);

  Pool& pool_;
  const Specification& specification_;
  const ServerOptions& options_;
  ServerCounters& counters_;
  EpisodeStatistics& episodes_;
  std::vector<std::uint32_t> all_;    // indices
  std::vector<std::uint32_t> ended_;  // in the last step
  Throttle throttle_;
};

}  // namespace walker
