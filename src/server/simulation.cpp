#include "server/simulation.h"

#include <exception>
#include <stdexcept>
#include <string>

#include <ros/console.h>

#include "episode/failure.h"
#include "ros/throttle.h"

namespace walker {
namespace {

// As many as a topic's queue keeps for who wants each of them (Outputs), and so few that nobody
// else waits for long.
constexpr std::uint32_t kMostSteps = 100;

}  // namespace

Simulation::Simulation(const ServerOptions& options, Environments& environments,
                       SimulationClock& clock, Outputs& outputs)
    : options_(options),
      environments_(environments),
      clock_(clock),
      outputs_(outputs),
      command_(environments.specification(), options.command_timeout,
               options.real_time_factor == 0),
      batch_calls_(environments, options_, counters_, episodes_) {}

void Simulation::reset(std::optional<std::uint64_t> seed) {
  clock_.require();
  EpisodeRecorder& environment = environments_.only("reset");
  const bool failed_before = environment.state().failed_at_reset();
  environment.reset(seed);
  stepping_agents_.clear();
  ++counters_.resets;
  if (environment.state().failed_at_reset()) {
    ++counters_.simulation_errors;
    if (!failed_before) log_failed_reset();
  }
  tell_reset();
}

/// A free-running server goes on by itself. It logs the first of a row of failures; in lock-step
/// the answer tells, and in either diagnostics do all the time.
void Simulation::log_failed_reset() const {
  if (options_.mode == Mode::lockstep) return;
  ROS_ERROR_STREAM("No episode: " << kResetFailed << ": " << shown().state().error << "; "
                                  << (options_.auto_reset
                                          ? "running, it is reset again after a second, and ~reset "
                                            "begins an episode at once"
                                          : "~reset begins the next"));
}

void Simulation::step(const std::vector<double>& action) {
  make_step(action);
  count_if_clamped(action);
}

void Simulation::step_many(const walker_sim::StepMany::Request& request,
                           walker_sim::StepMany::Response& response) {
  if (request.steps < 1 || request.steps > kMostSteps) {
    throw std::invalid_argument("steps = " + std::to_string(request.steps) + "; must be in [1, " +
                                std::to_string(kMostSteps) + "]");
  }
  clock_.require(static_cast<int>(request.steps));
  const EpisodeState& state = environments_.only("step_many").state();
  do {
    make_step(request.action);
    count_if_clamped(request.action);
    ++response.steps;
    response.total_reward += state.reward;
  } while (response.steps < request.steps && !state.has_ended());
}

void Simulation::step_by_command() {
  if (command_.expire(clock_.now().toNSec())) {
    ++counters_.command_timeouts;
    static Throttle throttle;
    if (throttle.passes()) {
      ROS_WARN_STREAM("No effort command for " << options_.command_timeout
                                               << " s: zero torque until the next");
    }
  }
  make_step(command_.action());
}

void Simulation::make_step(const std::vector<double>& action) {
  clock_.require();
  EpisodeRecorder& environment = environments_.only("step");
  const StepTiming::Clock::time_point begin = StepTiming::Clock::now();
  environment.step(action);
  timing_.step_took(StepTiming::Clock::now() - begin);
  ++counters_.steps;
  const EpisodeState& state = environment.state();
  if (!state.error.empty()) ++counters_.simulation_errors;
  if (state.has_ended()) episodes_.add(state);
  tell_step();
}

void Simulation::reset_batch(const walker_sim::ResetBatch::Request& request,
                             walker_sim::ResetBatch::Response& response) {
  clock_.require();
  const EpisodeState& state = shown().state();
  const std::uint32_t episode = state.episode;
  batch_calls_.reset(request, response);
  stepping_agents_.clear();
  if (state.episode != episode) {
    tell_reset();
  } else {
    advance_time();
  }
}

void Simulation::step_batch(const std::vector<double>& actions,
                            walker_sim::StepBatch::Response& response) {
  clock_.require(2);  // a step, and under same_step a reset
  const StepTiming::Clock::time_point begin = StepTiming::Clock::now();
  batch_calls_.step(actions, response);
  timing_.step_took(StepTiming::Clock::now() - begin);
  const EpisodeState& state = shown().state();
  if (state.step == 0) {
    tell_reset();
  } else {
    tell_step();
  }
  const std::uint32_t episode = state.episode;
  batch_calls_.reset_ended(response);
  if (state.episode != episode) tell_reset();
}

walker_sim::EpisodeRecord Simulation::snapshot() const {
  return outputs_.message(environments_.only("snapshot").record(), clock_.now());
}

void Simulation::restore(EpisodeRecorder& repeated) {
  clock_.require();
  environments_.only("restore").take_over(repeated);
  ++counters_.resets;
  command_.clear();
  stepping_agents_.clear();
  advance_time();
  outputs_.publish_restored(snapshot(), clock_.now());
}

void Simulation::advance_time() {
  clock_.advance();
  ++counters_.advances;
}

void Simulation::tell_step() {
  advance_time();
  outputs_.publish_step(clock_.now());
}

/// Of the shown environment. A command was meant for the episode before.
void Simulation::tell_reset() {
  command_.clear();
  advance_time();
  outputs_.publish_reset(clock_.now());
}

void Simulation::take_command(const std::vector<double>& efforts, const std::string& agent) {
  if (options_.mode == Mode::lockstep) {
    refuse_command("effort command: in mode lockstep only ~step drives the walker");
    return;
  }
  try {
    const bool takes_a_place = command_.state() == EffortCommand::State::held;
    command_.set(efforts, clock_.now().toNSec());
    if (takes_a_place) note_agent(agent);
    commanding_agent_ = agent;
    count_if_clamped(command_.action());
  } catch (const std::exception& error) {
    refuse_command(error.what());
  }
}

/// Of a command that takes the place of one that is held.
void Simulation::note_agent(const std::string& agent) {
  if (agent == commanding_agent_) return;
  ++counters_.contested_commands;
  static Throttle throttle;
  if (!throttle.passes()) return;
  ROS_WARN_STREAM("Two agents drive the walker: the effort command of "
                  << agent << " takes the place of that of " << commanding_agent_ << " ("
                  << counters_.contested_commands << " such commands so far)");
}

void Simulation::note_stepping(const std::string& agent) {
  if (!stepping_agents_.note(agent)) return;
  ++counters_.contested_steps;
  static Throttle throttle;
  if (!throttle.passes()) return;
  ROS_WARN_STREAM("Two agents step the walker: "
                  << agent << " goes on after a step of " << stepping_agents_.other() << " ("
                  << counters_.contested_steps << " such steps so far)");
}

void Simulation::refuse_command(const std::string& reason) {
  ++counters_.refused_commands;
  static Throttle throttle;
  if (!throttle.passes()) return;
  ROS_ERROR_STREAM("Refused " << reason << " (" << counters_.refused_commands << " so far)");
}

void Simulation::count_if_clamped(const std::vector<double>& action) {
  if (is_clamped(environments_.specification(), action.data())) ++counters_.clamped_commands;
}

}  // namespace walker
