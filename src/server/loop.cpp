#include "server/loop.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include <ros/console.h>
#include <ros/init.h>
#include <ros/names.h>
#include <ros/topic_manager.h>

#include "episode/failure.h"
#include "ros/throttle.h"

namespace walker {
namespace {

// How long the loop sleeps where nothing is due; a shutdown is noticed within this time.
constexpr std::chrono::milliseconds kIdle{50};
// A recorder that is started together with the server takes less.
constexpr std::chrono::seconds kRecorderStarts{3};
// After a reset at which the engine failed. Whatever the pace: where every reset fails, neither the
// processor nor subscribers are kept busy with it.
constexpr std::chrono::seconds kUntilNextReset{1};

}  // namespace

Loop::Loop(const ServerOptions& options, Simulation& simulation, Restores& restores,
           ServicePort& port, WakingQueue& callbacks)
    : options_(options),
      simulation_(simulation),
      restores_(restores),
      port_(port),
      callbacks_(callbacks),
      follows_clock_(options.mode == Mode::free && !options.publish_clock &&
                     ros::Time::isSimTime()),
      pacer_(simulation.shown().specification().dt, options.real_time_factor),
      follower_(static_cast<std::uint64_t>(simulation.clock().dt().toNSec())),
      is_paused_(options.mode == Mode::free && options.paused) {}

void Loop::wait_for(const RecorderWatch& recorder) {
  std::string complaint = recorder.complaint();
  ROS_INFO_STREAM("Waiting for the recorder: " << complaint);
  Clock::time_point is_late = Clock::now() + kRecorderStarts;
  while (ros::ok() && !complaint.empty()) {
    if (Clock::now() >= is_late) {
      ROS_WARN_STREAM("Nothing moves yet: " << complaint);
      is_late += kRecorderStarts;
    }
    serve(kIdle);
    complaint = recorder.complaint();
  }
}

void Loop::run() {
  if (options_.mode == Mode::free && !follows_clock_) begin_episode(std::nullopt);
  restart_schedule();
  while (ros::ok()) {
    if (runs_freely()) {
      step_when_due();
    } else {
      serve(kIdle);
    }
  }
}

bool Loop::runs_freely() const {
  if (options_.mode != Mode::free || is_paused_) return false;
  return options_.auto_reset || !state().has_ended();
}

bool Loop::waits_to_reset_again(Clock::time_point now) const {
  return state().failed_at_reset() && now < resets_again_at_;
}

Loop::Clock::duration Loop::until_due(Clock::time_point now) const {
  if (waits_to_reset_again(now)) return resets_again_at_ - now;
  return follows_clock_ ? std::chrono::milliseconds(1) : pacer_.remaining(now);
}

/// Waits for requests and callbacks, and answers what has come.
void Loop::serve(Clock::duration longest) {
  if (restores_.are_in_flight()) longest = Clock::duration::zero();
  if (port_.serve(callbacks_.descriptor(), longest)) callbacks_.call();
  if (restores_.go_on()) restart_schedule();
}

/// Waits for the next request, callback or deadline, whatever comes first.
void Loop::step_when_due() {
  serve(std::clamp<Clock::duration>(until_due(Clock::now()), {}, kIdle));
  if (!runs_freely() || !ros::ok()) return;  // a callback may have changed that
  const Clock::time_point now = Clock::now();
  if (waits_to_reset_again(now)) {
    restart_schedule();  // no deadline is missed meanwhile
    return;
  }
  if (follows_clock_) {
    follow_clock();
    return;
  }
  if (pacer_.remaining(now) > Clock::duration::zero()) return;
  simulation_.timing().step_begins(now, pacer_.period());
  simulation_.counters().missed_deadlines += pacer_.step_begins(now);
  step_freely();
}

void Loop::follow_clock() {
  SimulationClock& clock = simulation_.clock();
  const std::uint64_t now = std::min(ros::Time::now().toNSec(), ros::TIME_MAX.toNSec());
  const std::string clock_topic = ros::names::resolve("/clock");
  follower_.count(ros::TopicManager::instance()->getNumPublishers(clock_topic), Clock::now());
  const ClockFollower::Advice advice = follower_.look(now, clock.now().toNSec());
  clock.catch_up(ros::Time().fromNSec(advice.stamp));
  simulation_.counters().missed_deadlines += advice.missed;
  const std::string complaint = follower_.complaint();
  static Throttle throttle;
  if (!complaint.empty() && throttle.passes()) ROS_WARN_STREAM("Nothing moves: " << complaint);
  if (advice.is_due) step_freely();
}

void Loop::step_freely() {
  if (!simulation_.shown().has_episode() || state().has_ended()) {
    begin_episode(std::nullopt);
  } else {
    simulation_.step_by_command();
  }
}

void Loop::begin_episode(std::optional<std::uint64_t> seed) {
  simulation_.reset(seed);
  resets_again_at_ = Clock::now() + kUntilNextReset;
}

void Loop::reset(std::optional<std::uint64_t> seed) {
  begin_episode(seed);
  restart_schedule();
  if (state().failed_at_reset()) {
    throw std::runtime_error(std::string(kResetFailed) + ": " + state().error);
  }
}

void Loop::restart_schedule() {
  pacer_.restart(Clock::now());
  follower_.restart();
  simulation_.timing().interrupt();
}

void Loop::refuse_while_it_runs(const std::string& service) const {
  if (options_.mode == Mode::lockstep || is_paused_) return;
  throw std::logic_error(service + (runs_freely()
                                        ? ": mode is free and the simulation runs; call ~pause "
                                          "first, or start with mode lockstep"
                                        : ": the episode has ended, and ~reset begins the next"));
}

double Loop::real_time_factor() const {
  return waits_for_steps() || follows_clock_ ? 0 : pacer_.real_time_factor();
}

void Loop::set_real_time_factor(double factor) {
  if (options_.mode == Mode::lockstep) {
    throw std::logic_error("set_real_time_factor: in lockstep who calls ~step sets the pace");
  }
  if (follows_clock_) {
    throw std::logic_error(
        "set_real_time_factor: this server follows /clock, so its publisher sets the pace");
  }
  complete_parameters(server_parameters(), {{"real_time_factor", factor}});  // throws
  pacer_.set_real_time_factor(factor, Clock::now());
  simulation_.timing().interrupt();
  simulation_.command().count_in_wall_time(factor == 0, simulation_.clock().now().toNSec());
}

std::string Loop::pause() {
  if (options_.mode == Mode::lockstep) {
    return "nothing to pause: in lockstep nothing moves between steps";
  }
  const bool was_paused = std::exchange(is_paused_, true);
  return was_paused ? "was paused already" : "paused";
}

std::string Loop::unpause() {
  if (options_.mode == Mode::lockstep) {
    return "nothing to unpause: in lockstep only ~step moves anything";
  }
  if (!is_paused_) return "ran already";
  is_paused_ = false;
  restart_schedule();
  return "runs";
}

}  // namespace walker
