#include "server/server.h"

#include <algorithm>
#include <exception>
#include <stdexcept>
#include <utility>

#include <ros/console.h>
#include <ros/init.h>
#include <ros/names.h>
#include <ros/topic_manager.h>
#include <ros/transport_hints.h>

#include "core/failure.h"
#include "ros/checked_subscription.h"
#include "ros/throttle.h"
#include "server/gazebo_services.h"
#include "walker_sim/registry.h"

namespace walker {
namespace {

// How long the loop sleeps where nothing is due; a shutdown is noticed within this time.
constexpr std::chrono::milliseconds kIdle{50};
// A recorder that is started together with the server takes less.
constexpr std::chrono::seconds kRecorderStarts{3};
// After a reset at which the engine failed. Whatever the pace: where every reset fails, neither the
// processor nor subscribers are kept busy with it.
constexpr std::chrono::seconds kUntilNextReset{1};

/// Whose callbacks come through `queue`.
ros::NodeHandle make_node(WakingQueue& queue) {
  ros::NodeHandle node;
  node.setCallbackQueue(&queue);
  return node;
}

/// A walker of one name under the description of another would be shown wrong, or not at all.
void compare_with_description(const ros::NodeHandle& node, const Specification& specification) {
  std::string key;
  std::string description;
  if (!node.searchParam("robot_description", key) || !node.getParam(key, description)) return;
  for (const Link& link : specification.links) {
    if (description.find("<link name=\"" + link.name + "\"") != std::string::npos) continue;
    ROS_WARN_STREAM(key << " has no link " << link.name << ", so it describes another robot than "
                        << specification.id << "; walker.launch makes it from its arguments env "
                        << "and xml_file, not from config");
    return;
  }
}

void introduce(const Specification& specification, const ServerOptions& options) {
  ROS_INFO_STREAM("walker_sim " << version() << ": " << specification.id << " on "
                                << specification.engine << " " << specification.engine_version
                                << " from " << specification.engine_path << ", mode "
                                << to_text(options.mode));
}

}  // namespace

Server::Server(const ServerOptions& options)
    : Server(
          options, [&options] { return make(options.id, options.environment); },
          [options](const Parameters& camera) {
            return make_renderer(options.id, options.environment, camera);
          }) {}

Server::Server(const ServerOptions& options, const MakeEnvironment& make_environment,
               const MakeRenderer& make_renderer)
    : options_(options),
      node_(make_node(callbacks_)),
      environments_(options_, make_environment),
      shown_(environments_.shown()),
      dt_(to_duration(shown_.specification().dt)),
      clock_(options.publish_clock ? SimulationClock::owner(node_) : SimulationClock::silent()),
      publishers_(node_, shown_, options_),
      pictures_(node_, environments_, publishers_.frames(), options_, make_renderer),
      pacer_(shown_.specification().dt, options.real_time_factor),
      follower_(static_cast<std::uint64_t>(dt_.toNSec())),
      command_(shown_.specification(), options.command_timeout, options.real_time_factor == 0),
      paused_(options.mode == Mode::free && options.paused),
      batch_calls_(environments_, options_, counters_, episodes_),
      restores_(environments_, make_environment,
                [this](auto& restored, auto& response) { show_restored(restored, response); }),
      diagnostics_(
          node_, {options_, shown_, pacer_, command_, paused_, counters_, episodes_, timing_,
                  follower_, clock_, follows_clock(), pictures_.thread(), publishers_.recorder()}),
      effort_subscriber_(subscribe_checked<std_msgs::Float64MultiArray>(
          node_, "effort_command", 1, [this](const auto& message) { on_effort_command(*message); },
          [this](const auto& reason) { refuse("effort command: " + reason); },
          ros::TransportHints().tcpNoDelay())) {
  if (options_.recorder.empty()) offer_services();
  introduce(shown_.specification(), options_);
  compare_with_description(node_, shown_.specification());
}

void Server::run() {
  const bool on_wall_time = !options_.publish_clock && !ros::Time::isSimTime();
  if (on_wall_time) clock_.catch_up(ros::Time::now());
  // A first time above zero, so that nobody waits for one before the first reset. Who follows has
  // the time of /clock instead.
  if (!follows_clock()) clock_.advance(dt_);
  publishers_.publish_constants(clock_.now());
  if (!options_.recorder.empty()) {
    wait_for_recorder();
    if (!ros::ok()) return;
    offer_services();
  }
  if (options_.mode == Mode::free && !follows_clock()) begin_episode(std::nullopt);
  restart_schedule();
  while (ros::ok()) {
    if (runs_freely()) {
      step_when_due();
    } else {
      serve(kIdle);
    }
  }
}

void Server::offer_services() {
  services_.emplace(*this, port_);
  advertise_gazebo_services(*this, options_.mode, port_);
}

/// Without services, so that nobody's reset comes too early: a client waits until there is one.
void Server::wait_for_recorder() {
  std::string complaint = publishers_.recorder().complaint();
  ROS_INFO_STREAM("Waiting for the recorder: " << complaint);
  Pacer::Clock::time_point is_late = Pacer::Clock::now() + kRecorderStarts;
  while (ros::ok() && !complaint.empty()) {
    if (Pacer::Clock::now() >= is_late) {
      ROS_WARN_STREAM("Nothing moves yet: " << complaint);
      is_late += kRecorderStarts;
    }
    serve(kIdle);
    complaint = publishers_.recorder().complaint();
  }
}

bool Server::runs_freely() const {
  if (options_.mode != Mode::free || paused_) return false;
  return options_.auto_reset || !shown_.state().has_ended();
}

bool Server::waits_to_reset_again(Pacer::Clock::time_point now) const {
  return shown_.state().failed_at_reset() && now < resets_again_at_;
}

bool Server::follows_clock() const {
  return options_.mode == Mode::free && !options_.publish_clock && ros::Time::isSimTime();
}

Pacer::Clock::duration Server::until_due(Pacer::Clock::time_point now) const {
  if (waits_to_reset_again(now)) return resets_again_at_ - now;
  return follows_clock() ? std::chrono::milliseconds(1) : pacer_.remaining(now);
}

/// Waits for requests and callbacks, and answers what has come.
void Server::serve(Pacer::Clock::duration longest) {
  if (restores_.are_in_flight()) longest = Pacer::Clock::duration::zero();
  if (port_.serve(callbacks_.descriptor(), longest)) callbacks_.call();
  restores_.go_on();
}

/// Waits for the next request, callback or deadline, whatever comes first.
void Server::step_when_due() {
  serve(std::clamp<Pacer::Clock::duration>(until_due(Pacer::Clock::now()), {}, kIdle));
  if (!runs_freely() || !ros::ok()) return;  // a callback may have changed that
  const Pacer::Clock::time_point now = Pacer::Clock::now();
  if (waits_to_reset_again(now)) {
    restart_schedule();  // no deadline is missed meanwhile
    return;
  }
  if (follows_clock()) {
    follow_clock();
    return;
  }
  if (pacer_.remaining(now) > Pacer::Clock::duration::zero()) return;
  timing_.step_begins(now, pacer_.period());
  counters_.missed_deadlines += pacer_.step_begins(now);
  step_freely();
}

void Server::follow_clock() {
  const std::uint64_t now = std::min(ros::Time::now().toNSec(), ros::TIME_MAX.toNSec());
  const std::string clock_topic = ros::names::resolve("/clock");
  follower_.count(ros::TopicManager::instance()->getNumPublishers(clock_topic),
                  Pacer::Clock::now());
  const ClockFollower::Advice advice = follower_.look(now, clock_.now().toNSec());
  clock_.catch_up(ros::Time().fromNSec(advice.stamp));
  counters_.missed_deadlines += advice.missed;
  const std::string complaint = follower_.complaint();
  static Throttle throttle;
  if (!complaint.empty() && throttle.passes()) ROS_WARN_STREAM("Nothing moves: " << complaint);
  if (advice.is_due) step_freely();
}

void Server::step_freely() {
  if (!shown_.has_episode() || shown_.state().has_ended()) {
    begin_episode(std::nullopt);
    return;
  }
  if (command_.expire(clock_.now().toNSec())) {
    ++counters_.command_timeouts;
    static Throttle throttle;
    if (throttle.passes()) {
      ROS_WARN_STREAM("No effort command for " << options_.command_timeout
                                               << " s: zero torque until the next");
    }
  }
  advance(command_.action());
}

void Server::begin_episode(std::optional<std::uint64_t> seed) {
  clock_.require(dt_);
  const bool failed_before = shown_.state().failed_at_reset();
  environments_.only("reset").reset(seed);
  ++counters_.resets;
  if (shown_.state().failed_at_reset()) take_failed_reset(failed_before);
  show_reset();
}

/// A free-running server goes on by itself. It logs the first of a row of failures; in lock-step
/// the answer tells, and in either diagnostics do all the time.
void Server::take_failed_reset(bool failed_before) {
  ++counters_.simulation_errors;
  resets_again_at_ = Pacer::Clock::now() + kUntilNextReset;
  if (options_.mode == Mode::lockstep || failed_before) return;
  ROS_ERROR_STREAM("No episode: " << kResetFailed << ": " << shown_.state().error << "; "
                                  << (options_.auto_reset
                                          ? "running, it is reset again after a second, and ~reset "
                                            "begins an episode at once"
                                          : "~reset begins the next"));
}

void Server::advance(const std::vector<double>& action) {
  clock_.require(dt_);
  EpisodeRecorder& simulation = environments_.only("step");
  const StepTiming::Clock::time_point begin = StepTiming::Clock::now();
  simulation.step(action);
  timing_.step_took(StepTiming::Clock::now() - begin);
  ++counters_.steps;
  const EpisodeState& state = simulation.state();
  if (!state.error.empty()) ++counters_.simulation_errors;
  if (state.has_ended()) episodes_.add(state);
  show_step();
}

void Server::pass_time() {
  clock_.advance(dt_);
  ++counters_.advances;
}

/// Of the shown environment. A command was meant for the episode before.
void Server::pass_time_after_reset() {
  command_.clear();
  pass_time();
}

void Server::show_step() {
  pass_time();
  publishers_.publish_step(clock_.now());
  pictures_.show(clock_.now());
}

void Server::show_reset() {
  pass_time_after_reset();
  publishers_.publish_reset(clock_.now());
  pictures_.show(clock_.now());
}

void Server::reset(std::optional<std::uint64_t> seed) {
  begin_episode(seed);
  restart_schedule();
  const EpisodeState& state = shown_.state();
  if (state.failed_at_reset()) {
    throw std::runtime_error(std::string(kResetFailed) + ": " + state.error);
  }
}

void Server::step(const std::vector<double>& action) {
  refuse_while_it_runs("step");
  advance(action);
  count_if_clamped(action);
}

void Server::refuse_while_it_runs(const std::string& service) const {
  if (options_.mode == Mode::lockstep || paused_) return;
  throw std::logic_error(service + (runs_freely()
                                        ? ": mode is free and the simulation runs; call ~pause "
                                          "first, or start with mode lockstep"
                                        : ": the episode has ended, and ~reset begins the next"));
}

void Server::reset_batch(const walker_sim::ResetBatch::Request& request,
                         walker_sim::ResetBatch::Response& response) {
  clock_.require(dt_);
  const std::uint32_t episode = shown_.state().episode;
  batch_calls_.reset(request, response);
  if (shown_.state().episode != episode) {
    show_reset();
  } else {
    pass_time();
  }
  restart_schedule();
}

void Server::step_batch(const std::vector<double>& actions,
                        walker_sim::StepBatch::Response& response) {
  refuse_while_it_runs("step_batch");
  clock_.require(dt_ + dt_);  // a step, and under same_step a reset
  const StepTiming::Clock::time_point begin = StepTiming::Clock::now();
  batch_calls_.step(actions, response);
  timing_.step_took(StepTiming::Clock::now() - begin);
  const EpisodeState& state = shown_.state();
  if (state.step == 0) {
    show_reset();
  } else {
    show_step();
  }
  const std::uint32_t episode = state.episode;
  batch_calls_.reset_ended(response);
  if (state.episode != episode) show_reset();
}

walker_sim::EpisodeRecord Server::snapshot() const {
  walker_sim::EpisodeRecord message;
  message.actions = environments_.only("snapshot").record().actions;
  tell(message.spec);
  fill(shown_.state(), publishers_.frames(), clock_.now(), message.episode);
  return message;
}

void Server::restore(const walker_sim::EpisodeRecord& record,
                     const Reply<walker_sim::Restore::Response>& reply) {
  restores_.add(record, reply);
}

void Server::show_restored(EpisodeRecorder& restored, walker_sim::Restore::Response& response) {
  clock_.require(dt_);
  environments_.only("restore").take_over(restored);
  ++counters_.resets;
  pass_time_after_reset();
  publishers_.publish_restored(snapshot(), clock_.now());
  pictures_.show(clock_.now());
  restart_schedule();
  tell(response.transition);
}

void Server::set_real_time_factor(double factor) {
  if (options_.mode == Mode::lockstep) {
    throw std::logic_error("set_real_time_factor: in lockstep who calls ~step sets the pace");
  }
  if (follows_clock()) {
    throw std::logic_error(
        "set_real_time_factor: this server follows /clock, so its publisher sets the pace");
  }
  complete_parameters(server_parameters(), {{"real_time_factor", factor}});  // throws
  pacer_.set_real_time_factor(factor, Pacer::Clock::now());
  timing_.interrupt();
  command_.count_in_wall_time(factor == 0, clock_.now().toNSec());
}

std::string Server::pause() {
  if (options_.mode == Mode::lockstep) {
    return "nothing to pause: in lockstep nothing moves between steps";
  }
  const bool was_paused = std::exchange(paused_, true);
  return was_paused ? "was paused already" : "paused";
}

std::string Server::unpause() {
  if (options_.mode == Mode::lockstep) {
    return "nothing to unpause: in lockstep only ~step moves anything";
  }
  if (!paused_) return "ran already";
  paused_ = false;
  restart_schedule();
  return "runs";
}

/// After a pause or a reset: a period passes before the next step, and none has been missed.
void Server::restart_schedule() {
  pacer_.restart(Pacer::Clock::now());
  follower_.restart();
  timing_.interrupt();
}

void Server::render(const walker_sim::Render::Request& request,
                    const Reply<walker_sim::Render::Response>& reply) {
  pictures_.render(request, clock_.now(), reply);
}

void Server::tell(walker_sim::Transition& message) const {
  fill(shown_.state(), publishers_.frames(), clock_.now(), message);
}

void Server::tell(walker_sim::EnvironmentSpec& message) const {
  fill(shown_.specification(), options_, message);
}

void Server::on_effort_command(const std_msgs::Float64MultiArray& message) {
  if (options_.mode == Mode::lockstep) {
    refuse("effort command: in mode lockstep only ~step drives the walker");
    return;
  }
  try {
    command_.set(message.data, clock_.now().toNSec());
    count_if_clamped(command_.action());
  } catch (const std::exception& error) {
    refuse(error.what());
  }
}

void Server::count_if_clamped(const std::vector<double>& action) {
  if (is_clamped(shown_.specification(), action.data())) ++counters_.clamped_commands;
}

void Server::refuse(const std::string& reason) {
  ++counters_.refused_commands;
  static Throttle throttle;
  if (!throttle.passes()) return;
  ROS_ERROR_STREAM("Refused " << reason << " (" << counters_.refused_commands << " so far)");
}

}  // namespace walker
