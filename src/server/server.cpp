#include "server/server.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <stdexcept>
#include <utility>

#include <ros/callback_queue.h>
#include <ros/console.h>
#include <ros/init.h>
#include <ros/transport_hints.h>

#include "server/records.h"
#include "walker_sim/registry.h"

namespace walker {
namespace {

// How long the loop sleeps where nothing is due; a shutdown is noticed within this time.
constexpr std::chrono::milliseconds kIdle{50};
// A /clock that jumps ahead by more steps than this is followed by a slip, not by a burst.
constexpr std::int64_t kMostStepsToCatchUp = 5;

ros::WallDuration to_wall(Pacer::Clock::duration duration) {
  return ros::WallDuration(std::chrono::duration<double>(duration).count());
}

ros::Duration to_nanoseconds(double seconds) {
  constexpr double kPerSecond = 1e9;
  ros::Duration duration;
  duration.fromNSec(std::llround(seconds * kPerSecond));
  return duration;
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
    : options_(options),
      simulation_([this] { return make(options_.id, options_.environment); }, options.seed),
      dt_(to_nanoseconds(simulation_.specification().dt)),
      clock_(options.publish_clock ? SimulationClock::owner(node_) : SimulationClock::silent()),
      publishers_(node_, simulation_, options_),
      pacer_(simulation_.specification().dt, options.real_time_factor),
      command_(simulation_.specification(), options.command_timeout, options.real_time_factor == 0),
      paused_(options.paused),
      diagnostics_(node_, simulation_, options_, counters_),
      services_(*this),
      effort_subscriber_(node_.subscribe("effort_command", 1, &Server::on_effort_command, this,
                                         ros::TransportHints().tcpNoDelay())) {
  introduce(simulation_.specification(), options_);
  compare_with_description(node_, simulation_.specification());
}

void Server::run() {
  const bool on_wall_time = !options_.publish_clock && !ros::Time::isSimTime();
  if (on_wall_time) clock_.catch_up(ros::Time::now());
  // A first time above zero, so that nobody waits for one before the first reset.
  clock_.advance(dt_);
  publishers_.publish_constants(clock_.now());
  if (options_.mode == Mode::free && !follows_clock()) begin_episode(std::nullopt);
  pacer_.restart(Pacer::Clock::now());
  while (ros::ok()) {
    if (runs_freely()) {
      step_when_due();
    } else {
      ros::getGlobalCallbackQueue()->callAvailable(to_wall(kIdle));
    }
  }
}

bool Server::runs_freely() const {
  if (options_.mode != Mode::free || paused_) return false;
  return options_.auto_reset || !simulation_.state().has_ended();
}

bool Server::follows_clock() const {
  return options_.mode == Mode::free && !options_.publish_clock && ros::Time::isSimTime();
}

/// Waits for the next callback or deadline, whatever comes first.
void Server::step_when_due() {
  const Pacer::Clock::duration wait =
      follows_clock() ? std::chrono::milliseconds(1) : pacer_.remaining(Pacer::Clock::now());
  const Pacer::Clock::duration longest = kIdle;
  ros::getGlobalCallbackQueue()->callAvailable(
      to_wall(std::clamp(wait, Pacer::Clock::duration::zero(), longest)));
  if (!runs_freely() || !ros::ok()) return;  // a callback may have changed that
  if (follows_clock()) {
    follow_clock();
  } else if (pacer_.remaining(Pacer::Clock::now()) <= Pacer::Clock::duration::zero()) {
    pacer_.step_begins(Pacer::Clock::now());
    step_freely();
    counters_.missed_deadlines = pacer_.missed_deadlines();
  }
}

void Server::follow_clock() {
  const ros::Time now = ros::Time::now();
  if (now.isZero()) return;  // no /clock yet
  if (!simulation_.has_episode()) {
    clock_.catch_up(now - std::min(dt_, now - ros::Time(0, 1)));
    begin_episode(std::nullopt);
    return;
  }
  const ros::Duration ahead = now - clock_.now();
  if (ahead > dt_ * static_cast<double>(kMostStepsToCatchUp)) {
    clock_.catch_up(now - dt_);
    ++counters_.missed_deadlines;
  }
  if (clock_.now() + dt_ <= now) step_freely();
}

void Server::step_freely() {
  if (simulation_.state().has_ended()) {
    begin_episode(std::nullopt);
    return;
  }
  const bool had_timed_out = command_.has_timed_out();
  const std::vector<double>& action = command_.action(clock_.now().toNSec());
  if (command_.has_timed_out() && !had_timed_out) {
    ++counters_.command_timeouts;
    ROS_WARN_STREAM("No effort command for " << options_.command_timeout
                                             << " s: zero torque until the next");
  }
  advance(action);
}

void Server::begin_episode(std::optional<std::uint64_t> seed) {
  simulation_.reset(seed);
  command_.clear();
  clock_.advance(dt_);
  publishers_.publish_reset(clock_.now());
}

void Server::advance(const std::vector<double>& action) {
  simulation_.step(action);
  ++counters_.steps;
  clock_.advance(dt_);
  publishers_.publish_step(clock_.now());
}

void Server::reset(std::optional<std::uint64_t> seed) {
  begin_episode(seed);
  pacer_.restart(Pacer::Clock::now());
}

void Server::step(const std::vector<double>& action) {
  if (options_.mode == Mode::free && !paused_) {
    throw std::logic_error(
        "step: mode is free and the simulation runs; call ~pause first, or start with mode "
        "lockstep");
  }
  advance(action);
  count_if_clamped(action);
}

walker_sim::EpisodeRecord Server::snapshot() const {
  walker_sim::EpisodeRecord message;
  message.actions = simulation_.record().actions;
  tell(message.spec);
  fill(simulation_.state(), publishers_.frames(), clock_.now(), message.episode);
  return message;
}

void Server::restore(const walker_sim::EpisodeRecord& record) {
  simulation_.restore(to_record(record));
  command_.clear();
  clock_.advance(dt_);
  publishers_.publish_restored(snapshot(), clock_.now());
  pacer_.restart(Pacer::Clock::now());
}

void Server::set_real_time_factor(double factor) {
  if (options_.mode == Mode::lockstep) {
    throw std::logic_error("set_real_time_factor: in lockstep who calls ~step sets the pace");
  }
  (void)factor;
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
  pacer_.restart(Pacer::Clock::now());
  const bool was_paused = std::exchange(paused_, false);
  return was_paused ? "runs" : "ran already";
}

void Server::tell(walker_sim::Transition& message) const {
  fill(simulation_.state(), publishers_.frames(), clock_.now(), message);
}

void Server::tell(walker_sim::EnvironmentSpec& message) const {
  fill(simulation_.specification(), options_, message);
}

void Server::on_effort_command(const std_msgs::Float64MultiArray& message) {
  if (options_.mode == Mode::lockstep) {
    refuse("effort command: in mode lockstep only ~step drives the walker");
    return;
  }
  try {
    const std::uint64_t now = clock_.now().toNSec();
    command_.set(message.data, now);
    count_if_clamped(command_.action(now));
  } catch (const std::exception& error) {
    refuse(error.what());
  }
}

void Server::count_if_clamped(const std::vector<double>& action) {
  if (is_clamped(simulation_.specification(), action)) ++counters_.clamped_commands;
}

void Server::refuse(const std::string& reason) {
  ++counters_.refused_commands;
  // By wall time: in lock-step simulation time may stand still.
  static ros::WallTime last_said;
  const ros::WallTime now = ros::WallTime::now();
  if (now - last_said < ros::WallDuration(1)) return;
  last_said = now;
  ROS_ERROR_STREAM("Refused " << reason << " (" << counters_.refused_commands << " so far)");
}

}  // namespace walker
