// What a server simulates, and what a step, a reset or a restore does.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "server/environments/batch_calls.h"
#include "server/environments/environments.h"
#include "server/outputs.h"
#include "server/parameter_reader.h"
#include "server/stepping_agents.h"
#include "server/time/simulation_clock.h"
#include "server/time/step_timing.h"
#include "server/topics/effort_command.h"
#include "server/topics/episode_statistics.h"
#include "walker_sim/StepMany.h"

namespace walker {

/// The environments in their time. Each call moves them, then the clock, and tells what came of it.
class Simulation {
 public:
  /// What it is given but the options outlives it.
  Simulation(const ServerOptions& options, Environments& environments, SimulationClock& clock,
             Outputs& outputs);

  // Each throws a std::exception that says why not; then nothing has changed. With many
  // environments those that are for one throw.

  /// Begins an episode. Without a seed the generator continues. Where the engine fails, it has
  /// ended with that.
  void reset(std::optional<std::uint64_t> seed);
  /// Makes exactly one step.
  void step(const std::vector<double>& action);
  /// Repeats an action, at the most to the episode's end.
  void step_many(const walker_sim::StepMany::Request& request,
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
  void restore(EpisodeRecorder& repeated);

  /// Holds an effort command, or counts it as refused. One that takes the place of another agent's
  /// is counted as contested.
  /// @param agent name of the node that has sent it
  void take_command(const std::vector<double>& efforts, const std::string& agent);
  void refuse_command(const std::string& reason);
  /// Of a call that has stepped. Where two agents do so within an episode, it is counted as
  /// contested.
  /// @param agent name of the node that has called
  void note_stepping(const std::string& agent);

  const EpisodeRecorder& shown() const { return environments_.shown(); }
  Environments& environments() const { return environments_; }
  SimulationClock& clock() const { return clock_; }
  EffortCommand& command() { return command_; }
  const EpisodeStatistics& episodes() const { return episodes_; }
  ServerCounters& counters() { return counters_; }
  StepTiming& timing() { return timing_; }

 private:
  void advance_time();
  void tell_step();
  void tell_reset();
  void make_step(const std::vector<double>& action);
  void log_failed_reset() const;
  void count_if_clamped(const std::vector<double>& action);
  void note_agent(const std::string& agent);

  ServerOptions options_;
  Environments& environments_;
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
