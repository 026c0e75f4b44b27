// What a server simulates, and what a step, a reset or a restore does.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "server/batch_calls.h"
#include "server/environments.h"
#include "server/outputs.h"
#include "server/parameter_reader.h"
#include "server/stepping_agents.h"
#include "server/time/simulation_clock.h"
#include "server/time/step_timing.h"
#include "server/topics/effort_command.h"
#include "server/topics/episode_statistics.h"
#include "walker_sim/StepMany.h"

namespace walker {

/// The environments in their time. Each call moves them, then the clock, and publishes the outcome.
class Simulation {
 public:
  /// What it is given but the options outlives it.
  Simulation(const ServerOptions& options, Pool& pool, SimulationClock& clock, Outputs& outputs);

  // Each throws a std::exception with the reason if it cannot be done; then nothing has changed.
  // Those for one environment throw if there are many, and return its state.

  /// Begins an episode. Without a seed the generator continues. If the engine fails, the episode
  /// has ended with that.
  const EpisodeState& reset(std::optional<std::uint64_t> seed);
  /// Makes exactly one step.
  const EpisodeState& step(const std::vector<double>& action);
  /// Repeats an action, at most to the episode's end.
  const EpisodeState& step_many(const walker_sim::StepMany::Request& request,
                                walker_sim::StepMany::Response& response);
  /// The same as `step` by the effort command that is held.
  void step_by_command();
  /// Begins episodes of several environments. An engine that fails concerns its own alone.
  void reset_batch(const walker_sim::ResetBatch::Request& request,
                   walker_sim::ResetBatch::Response& response);
  /// Steps every environment once, or resets it where the autoreset mode says so.
  void step_batch(const std::vector<double>& actions, walker_sim::StepBatch::Response& response);
  /// The present episode.
  walker_sim::EpisodeRecord snapshot() const;
  /// An episode that was repeated takes the present one's place.
  const EpisodeState& restore(Episode& repeated);

  /// Holds an effort command, or counts it as refused. One that takes the place of another agent's
  /// is counted as contested.
  /// @param agent name of the node that has sent it
  void take_command(const std::vector<double>& efforts, const std::string& agent);
  void refuse_command(const std::string& reason);
  /// Counts a step as contested if two agents step within an episode.
  /// @param agent name of the node whose call has stepped
  void record_stepping(const std::string& agent);

  const Episode& shown() const { return shown_; }
  Pool& pool() const { return pool_; }
  SimulationClock& clock() const { return clock_; }
  EffortCommand& command() { return command_; }
  const EpisodeStatistics& episodes() const { return episodes_; }
  ServerCounters& counters() { return counters_; }
  StepTiming& timing() { return timing_; }

 private:
  void advance_time();
  void publish_step();
  void publish_reset();
  const EpisodeState& make_step(const std::vector<double>& action);
  void count_if_clamped(const std::vector<double>& action);
  void record_commanding(const std::string& agent);

  ServerOptions options_;
  Pool& pool_;
  const Episode& shown_;
  SimulationClock& clock_;
  Outputs& outputs_;
  EffortCommand command_;
  std::string commanding_agent_;  // whose command was the last one
  SteppingAgents stepping_agents_;
  ServerCounters counters_;
  EpisodeStatistics episodes_;
  StepTiming timing_;
  BatchCalls batch_calls_;
};

}  // namespace walker
