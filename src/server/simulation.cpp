#include "server/simulation.h"

#include <algorithm>
#include <chrono>
#include <exception>
#include <functional>
#include <stdexcept>
#include <utility>

#include <ros/console.h>

#include "base/printable_text.h"
#include "ros/message_conversions.h"
#include "ros/throttle.h"

namespace walker {
namespace {

// One request overflows no topic's queue, and other requests do not wait long.
constexpr std::uint32_t kMaxSteps = kListenerQueue;

}  // namespace

Simulation::Simulation(const ServerOptions& options, Pool& pool, SimulationClock& clock,
                       Outputs& outputs)
    : options_(options),
      pool_(pool),
      shown_(pool.walker(options.shown_environment)),
      frames_(pool.specification(), options.tf_prefix),
      clock_(clock),
      outputs_(outputs),
      command_(pool.specification(), options.command_timeout, options.real_time_factor == 0),
      batch_calls_(pool, options_, account_) {}

/// Makes a call that may change worlds, and publishes the specification if it has.
template <typename Change>
void Simulation::change_worlds(const Change& change) {
  const World before = shown_.world();
  change();
  if (shown_.world() != before) outputs_.publish_spec();
}

const EpisodeState& Simulation::reset(std::optional<std::uint64_t> seed,
                                      const std::optional<World>& world) {
  clock_.require();
  Walker& environment = single_walker(pool_, "reset");
  const auto abandoned = outputs_.abandoned_record();
  if (world) change_worlds([&] { environment.set_world(*world); });
  outputs_.publish_abandoned(abandoned);
  environment.reset(seed);
  stepping_agents_.clear();
  account_.add(environment.state());
  publish_reset();
  return environment.state();
}

const EpisodeState& Simulation::step(const std::vector<double>& action) {
  const EpisodeState& state = make_step(action);
  count_if_clamped(action);
  return state;
}

const EpisodeState& Simulation::step_many(const StepMany::Request& request,
                                          StepMany::Response& response) {
  if (request.steps < 1 || request.steps > kMaxSteps) {
    throw std::invalid_argument("steps = " + std::to_string(request.steps) + "; must be in [1, " +
                                std::to_string(kMaxSteps) + "]");
  }
  clock_.require(static_cast<int>(request.steps));
  const EpisodeState& state = single_walker(pool_, "step_many").state();
  do {
    step(request.action);
    ++response.steps;
    response.total_reward += state.reward;
  } while (response.steps < request.steps && !state.has_ended());
  return state;
}

void Simulation::step_by_command() {
  if (command_.expire(clock_.now().toNSec())) {
    ++account_.counters.command_timeouts;
    static Throttle throttle;
    if (throttle.passes()) {
      ROS_WARN_STREAM("No effort command for " << options_.command_timeout
                                               << " s: zero torque until the next");
    }
  }
  make_step(command_.action());
}

const EpisodeState& Simulation::make_step(const std::vector<double>& action) {
  clock_.require();
  Walker& environment = single_walker(pool_, "step");
  const StepTiming::Clock::time_point begin = StepTiming::Clock::now();
  environment.step(action);
  timing_.step_took(StepTiming::Clock::now() - begin);
  account_.add(environment.state());
  publish_step();
  return environment.state();
}

void Simulation::reset_batch(const ResetBatch::Request& request, ResetBatch::Response& response) {
  clock_.require();
  const EpisodeState& state = shown().state();
  const std::uint32_t episode = state.episode;
  const std::vector<std::uint32_t>& listed = request.environments;
  const bool is_shown_listed =
      listed.empty() || std::count(listed.begin(), listed.end(), options_.shown_environment) != 0;
  const auto abandoned = is_shown_listed ? outputs_.abandoned_record() : std::nullopt;
  change_worlds([&] { batch_calls_.reset(request, response); });
  stepping_agents_.clear();
  if (state.episode != episode) {
    outputs_.publish_abandoned(abandoned);
    publish_reset();
  } else {
    advance_time();
    clock_.publish();
  }
}

void Simulation::step_batch(const std::vector<double>& actions, StepBatch::Response& response) {
  clock_.require(2);  // a step, and under same_step a reset
  const StepTiming::Clock::time_point begin = StepTiming::Clock::now();
  const EpisodeState& state = shown().state();
  std::uint32_t episode = 0;  // that the step has reached
  const auto show = [&] {
    timing_.step_took(StepTiming::Clock::now() - begin);
    episode = state.episode;
    if (state.step == 0) {
      publish_reset();
    } else {
      publish_step();
    }
  };
  batch_calls_.step(actions, response, std::cref(show));
  if (state.episode != episode) publish_reset();
}

void Simulation::set_worlds(const SetWorld::Request& request) {
  change_worlds([&] { batch_calls_.set_worlds(request); });
}

walker_sim::EpisodeRecord Simulation::snapshot() const {
  return outputs_.message(single_walker(pool_, "snapshot").record());
}

const EpisodeState& Simulation::restore(Walker& repeated) {
  clock_.require();
  Walker& environment = single_walker(pool_, "restore");
  outputs_.publish_abandoned(outputs_.abandoned_record());
  environment.take_over(repeated);
  ++account_.counters.resets;
  stepping_agents_.clear();
  publish_reset();
  return environment.state();
}

const EpisodeState& Simulation::set_state(const SetState::Request& request) {
  clock_.require();
  check_environment(pool_, "environment", request.environment);
  Walker& environment = pool_.walker(request.environment);
  environment.set_coordinates(request.position, request.velocity);
  if (&environment == &shown_) {
    publish_reset();
  } else {
    advance_time();
    clock_.publish();
  }
  return environment.state();
}

void Simulation::advance_time() {
  clock_.advance();
  ++account_.counters.advances;
}

void Simulation::publish_step() {
  advance_time();
  outputs_.publish_step();
}

/// Also clears the held command, which was meant for the state before.
void Simulation::publish_reset() {
  command_.clear();
  advance_time();
  outputs_.publish_reset();
}

void Simulation::take_command(const std::vector<double>& efforts, const std::string& agent) {
  try {
    const bool takes_a_place = command_.state() == EffortCommand::State::held;
    command_.set(efforts, clock_.now().toNSec());
    count_if_clamped(command_.action());
    const std::string before = std::exchange(commanding_agent_, agent);
    if (!takes_a_place || agent == before) return;
    ++account_.counters.contested_commands;
    static Throttle throttle;
    if (!throttle.passes()) return;
    ROS_WARN_STREAM("Two agents drive the walker: the effort command of "
                    << agent << " replaces that of " << before << " ("
                    << account_.counters.contested_commands << " such commands so far)");
  } catch (const std::exception& error) {
    refuse_command(error.what());
  }
}

void Simulation::record_stepping(const std::string& agent) {
  if (!stepping_agents_.record(agent)) return;
  ++account_.counters.contested_steps;
  static Throttle throttle;
  if (!throttle.passes()) return;
  ROS_WARN_STREAM("Two agents step the walker: "
                  << agent << " resumes after a step of " << stepping_agents_.other() << " ("
                  << account_.counters.contested_steps << " such steps so far)");
}

void Simulation::refuse_command(const std::string& reason) {
  ++account_.counters.refused_commands;
  static Throttle throttle;
  if (!throttle.passes()) return;
  ROS_ERROR_STREAM("Refused " << reason << " (" << account_.counters.refused_commands
                              << " so far)");
}

void Simulation::take_push(const geometry_msgs::WrenchStamped& message) {
  try {
    shown_.push(to_link_wrench(message, frames_, shown_.sensors()));
    ++account_.counters.pushes;
  } catch (const std::exception& error) {
    refuse_push(error.what());
  }
}

void Simulation::refuse_push(const std::string& reason) {
  ++account_.counters.refused_pushes;
  push_refusal_ = reason;
  static Throttle throttle;
  if (!throttle.passes()) return;
  ROS_ERROR_STREAM("Refused push: " << reason << " (" << account_.counters.refused_pushes
                                    << " so far)");
}

void Simulation::count_if_clamped(const std::vector<double>& action) {
  if (is_clamped(pool_.specification(), action.data())) ++account_.counters.clamped_commands;
}

Restores::Restores(Simulation& simulation, Outputs& outputs, const MakeEnvironment& make)
    : simulation_(simulation), outputs_(outputs) {
  if (simulation.pool().options().num_envs != 1) return;
  scratch_ = make();
  WalkerOptions options;
  options.records_actions = true;
  walker_of(*scratch_).configure(options);
}

void Restores::add(const walker_sim::EpisodeRecord& record, const Reply<Response>& reply) {
  single_walker(simulation_.pool(), "restore");  // throws if there are several
  // Frees the records of clients that have disconnected.
  waiting_.erase(std::remove_if(waiting_.begin(), waiting_.end(),
                                [](const Waiting& each) { return !each.reply.is_awaited(); }),
                 waiting_.end());
  waiting_.push_back({to_record(record), reply});
}

bool Restores::continue_first() {
  while (!waiting_.empty() && !waiting_.front().reply.is_awaited()) waiting_.pop_front();
  if (waiting_.empty()) return false;
  Waiting& first = waiting_.front();
  Walker& scratch = walker_of(*scratch_);
  Response response;
  try {
    if (!std::exchange(first.has_begun, true)) scratch.begin(first.record);
    // Upper bound of the delay of other requests and of a due step.
    constexpr std::chrono::milliseconds kSlice{1};
    if (!scratch.repeat(first.record, std::chrono::steady_clock::now() + kSlice)) return false;
    const EpisodeState& state = simulation_.restore(scratch);
    response.transition = outputs_.message(state);
    to_message(state.drawn_world(), response.world);
    response.success = 1;
  } catch (const std::exception& error) {
    response.status_message = printable(error.what());
  }
  first.reply(response);
  waiting_.pop_front();
  return response.success != 0;
}

}  // namespace walker
