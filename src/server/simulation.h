// Steps, resets and restores of a server's environments.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <geometry_msgs/WrenchStamped.h>

#include "server/batch_calls.h"
#include "server/outputs.h"
#include "server/parameter_reader.h"
#include "server/time/simulation_clock.h"
#include "server/topics/commands.h"
#include "server/topics/converters.h"
#include "server/topics/statistics.h"
#include "server/transport/waking.h"
#include "walker_sim/Restore.h"
#include "walker_sim/SetState.h"
#include "walker_sim/StepMany.h"

namespace walker {

using walker_sim::SetState;
using walker_sim::StepMany;

/// Environments and their time. Each call steps, resets or sets a state, advances the clock and
/// publishes.
class Simulation {
 public:
  /// @param pool, clock, outputs outlive this
  Simulation(const ServerOptions& options, Pool& pool, SimulationClock& clock, Outputs& outputs);

  // A call that is refused throws a std::exception with the reason and changes nothing. Calls for
  // one environment throw if there are several, and return its state.

  /// Begins an episode. Without a seed the generator continues. If the engine fails, the episode
  /// has ended at once (`failed_at_reset`).
  /// @param world of this and the following episodes; nullopt: as before
  const EpisodeState& reset(std::optional<std::uint64_t> seed, const std::optional<World>& world);
  const EpisodeState& step(const std::vector<double>& action);
  /// Repeats an action until the number of steps is reached or the episode ends.
  const EpisodeState& step_many(const StepMany::Request& request, StepMany::Response& response);
  void step_by_command();
  /// Begins episodes of several environments. An engine failure affects only its own environment.
  void reset_batch(const ResetBatch::Request& request, ResetBatch::Response& response);
  /// Steps every environment once, or resets it if the autoreset mode requires it.
  void step_batch(const std::vector<double>& actions, StepBatch::Response& response);
  void set_worlds(const SetWorld::Request& request);
  walker_sim::EpisodeRecord snapshot() const;
  /// Replaces the present episode by a repeated one.
  const EpisodeState& restore(Walker& repeated);

  /// Sets positions and velocities of an environment, whose episode continues from there.
  const EpisodeState& set_state(const SetState::Request& request);

  /// Holds an effort command, or counts it as refused. A command that replaces another agent's held
  /// command is counted as contested.
  /// @param agent name of the node that sent it
  void take_command(const std::vector<double>& efforts, const std::string& agent);
  void refuse_command(const std::string& reason);
  /// Adds a push by hand to the shown environment's next step, or counts it as refused.
  void take_push(const geometry_msgs::WrenchStamped& message);
  void refuse_push(const std::string& reason);
  /// Why the latest refused push was refused; empty if none was.
  const std::string& push_refusal() const { return push_refusal_; }
  /// Counts a step as contested if two agents step in turns within an episode.
  void record_stepping(const std::string& agent);

  const Walker& shown() const { return shown_; }
  Pool& pool() const { return pool_; }
  SimulationClock& clock() const { return clock_; }
  EffortCommand& command() { return command_; }
  const EpisodeStatistics& episodes() const { return account_.episodes; }
  ServerCounters& counters() { return account_.counters; }
  StepTiming& timing() { return timing_; }

 private:
  void advance_time();
  void publish_step();
  void publish_reset();
  template <typename Change>
  void change_worlds(const Change& change);
  const EpisodeState& make_step(const std::vector<double>& action);
  void count_if_clamped(const std::vector<double>& action);

  ServerOptions options_;
  Pool& pool_;
  Walker& shown_;
  const Frames frames_;
  SimulationClock& clock_;
  Outputs& outputs_;
  EffortCommand command_;
  std::string commanding_agent_;  // sender of the latest command
  SteppingAgents stepping_agents_;
  std::string push_refusal_;
  Account account_;
  StepTiming timing_;
  BatchCalls batch_calls_;
};

/// ~restore: repeats records in the order of the requests, a millisecond at a time, in a scratch
/// environment. The present episode continues meanwhile, and stays if a record is wrong.
class Restores {
 public:
  using Response = walker_sim::Restore::Response;

  /// @param simulation, outputs outlive this
  Restores(Simulation& simulation, Outputs& outputs, const MakeEnvironment& make);

  /// @throws std::exception if there are several environments or the record is malformed
  void add(const walker_sim::EpisodeRecord& record, const Reply<Response>& reply);

  bool are_in_flight() const { return !waiting_.empty(); }

  /// Repeats one slice of the first record, if there is one.
  /// @return whether an episode has been restored
  bool continue_first();

 private:
  struct Waiting {
    EpisodeRecord record;
    Reply<Response> reply;
    bool has_begun = false;
  };

  Simulation& simulation_;
  Outputs& outputs_;
  std::unique_ptr<Environment> scratch_;  // null if there are several environments
  std::deque<Waiting> waiting_;           // the first is in flight
};

}  // namespace walker
