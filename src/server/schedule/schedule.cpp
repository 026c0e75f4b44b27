#include "server/schedule/schedule.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include <ros/console.h>
#include <ros/names.h>
#include <ros/time.h>
#include <ros/topic_manager.h>

#include "base/pacer.h"
#include "ros/throttle.h"
#include "server/time/clock_follower.h"

namespace walker {
namespace {

constexpr std::chrono::seconds kUntilNextReset{1};  // after a failed reset

/// Only service calls step.
class LockstepSchedule : public Schedule {
 public:
  using Schedule::Schedule;

  bool takes_commands() const override { return false; }
  void set_real_time_factor(double /*factor*/) override {
    throw std::logic_error(
        "set_real_time_factor: in mode lockstep the callers of ~step set the pace");
  }
  std::string pause() override {
    return "nothing to pause: in lockstep nothing moves between steps";
  }
  std::string unpause() override {
    return "nothing to unpause: in lockstep only ~step moves anything";
  }
  const char* pace() const override { return "the callers of ~step set the pace"; }
};

/// Steps with the held effort command, resets unless `auto_reset` is off, and can be paused; then
/// service calls may step. After a failed reset it waits a second at any pace, so that an engine
/// that fails at every reset floods neither the processor nor subscribers.
class RunningSchedule : public Schedule {
 public:
  RunningSchedule(const ServerOptions& options, Simulation& simulation)
      : Schedule(simulation), auto_reset_(options.auto_reset), is_paused_(options.paused) {}

  Clock::duration until_due(Clock::time_point now) const override {
    if (!runs()) return kIdle;
    const Clock::duration due =
        waits_to_reset_again(now) ? resets_again_at_ - now : until_step(now);
    return std::clamp<Clock::duration>(due, {}, kIdle);
  }

  void step_if_due() override {
    if (!runs()) return;
    const Clock::time_point now = Clock::now();
    if (waits_to_reset_again(now)) {
      restart_schedule();  // no deadline counts as missed meanwhile
    } else if (is_step_due(now)) {
      if (!state().has_begun() || state().has_ended()) {
        begin_episode(std::nullopt, std::nullopt);
      } else {
        simulation_.step_by_command();
      }
    }
  }

  void require_steps_by_service(const std::string& service) const override {
    if (is_paused_) return;
    throw std::logic_error(service + (runs()
                                          ? ": mode is free and the simulation runs; call ~pause "
                                            "first, or start with mode lockstep"
                                          : ": the episode has ended, and ~reset begins the next"));
  }

  bool takes_commands() const override { return true; }

  std::string pause() override {
    return std::exchange(is_paused_, true) ? "was paused already" : "paused";
  }

  std::string unpause() override {
    if (!is_paused_) return "ran already";
    is_paused_ = false;
    restart_schedule();
    return "runs";
  }

  bool is_paused() const override { return is_paused_; }

 protected:
  /// Logs the first of consecutive failures; diagnostics report all of them.
  void begin_episode(std::optional<std::uint64_t> seed,
                     const std::optional<World>& world) override {
    const bool failed_before = state().failed_at_reset();
    simulation_.reset(seed, world);
    resets_again_at_ = Clock::now() + kUntilNextReset;
    if (failed_before || !state().failed_at_reset()) return;
    ROS_ERROR_STREAM("No episode: " << kResetFailed << ": " << state().error << "; "
                                    << (auto_reset_
                                            ? "unless it is paused, the server resets again after "
                                              "a second; ~reset begins an episode at once"
                                            : "~reset begins the next"));
  }

 private:
  virtual Clock::duration until_step(Clock::time_point now) const = 0;
  /// Whether to make the next step now. Called only if it may be made.
  virtual bool is_step_due(Clock::time_point now) = 0;

  const EpisodeState& state() const { return simulation_.shown().state(); }
  bool runs() const { return !is_paused_ && (auto_reset_ || !state().has_ended()); }
  bool waits_to_reset_again(Clock::time_point now) const {
    return state().failed_at_reset() && now < resets_again_at_;
  }

  bool auto_reset_;
  bool is_paused_;
  Clock::time_point resets_again_at_;  // after a failed reset
};

class FreeSchedule : public RunningSchedule {
 public:
  FreeSchedule(const ServerOptions& options, Simulation& simulation)
      : RunningSchedule(options, simulation),
        pacer_(simulation.shown().specification().dt, options.real_time_factor) {}

  void start() override {
    begin_episode(std::nullopt, std::nullopt);
    restart_schedule();
  }

  void restart_schedule() override {
    RunningSchedule::restart_schedule();
    pacer_.restart(Clock::now());
  }

  void set_real_time_factor(double factor) override {
    complete_parameters(server_parameters(), {{"real_time_factor", factor}});  // throws
    pacer_.set_real_time_factor(factor, Clock::now());
    simulation_.timing().interrupt();
    simulation_.command().count_in_wall_time(factor == 0, simulation_.clock().now().toNSec());
  }

  std::optional<double> real_time_factor() const override { return pacer_.real_time_factor(); }
  const char* pace() const override {
    if (is_paused()) return "paused";
    return pacer_.real_time_factor() == 0 ? "as fast as it goes" : "keeps up";
  }

 private:
  Clock::duration until_step(Clock::time_point now) const override { return pacer_.remaining(now); }

  bool is_step_due(Clock::time_point now) override {
    if (pacer_.remaining(now) > Clock::duration::zero()) return false;
    simulation_.timing().step_begins(now, pacer_.period());
    simulation_.counters().missed_deadlines += pacer_.step_begins(now);
    return true;
  }

  Pacer pacer_;
};

/// Steps as another node's /clock advances.
class FollowSchedule : public RunningSchedule {
 public:
  FollowSchedule(const ServerOptions& options, Simulation& simulation)
      : RunningSchedule(options, simulation),
        follower_(static_cast<std::uint64_t>(simulation.clock().dt().toNSec())) {}

  void restart_schedule() override {
    RunningSchedule::restart_schedule();
    follower_.restart();
  }

  void set_real_time_factor(double /*factor*/) override {
    throw std::logic_error(
        "set_real_time_factor: this server follows /clock, so its publisher sets the pace");
  }

  bool follows_clock() const override { return true; }
  const char* pace() const override { return is_paused() ? "paused" : "follows /clock"; }
  std::string complaint() const override { return is_paused() ? "" : follower_.complaint(); }

 private:
  Clock::duration until_step(Clock::time_point /*now*/) const override {
    return std::chrono::milliseconds(1);
  }

  bool is_step_due(Clock::time_point now) override {
    SimulationClock& clock = simulation_.clock();
    const std::uint64_t time = std::min(ros::Time::now().toNSec(), ros::TIME_MAX.toNSec());
    const std::string clock_topic = ros::names::resolve("/clock");
    follower_.record_publishers(ros::TopicManager::instance()->getNumPublishers(clock_topic), now);
    const ClockFollower::Decision decision = follower_.update(time, clock.now().toNSec());
    clock.catch_up(ros::Time().fromNSec(decision.stamp));
    simulation_.counters().missed_deadlines += decision.missed;
    const std::string complaint = follower_.complaint();
    static Throttle throttle;
    if (!complaint.empty() && throttle.passes()) ROS_WARN_STREAM("Nothing moves: " << complaint);
    return decision.is_due;
  }

  ClockFollower follower_;
};

}  // namespace

const EpisodeState& Schedule::reset(std::optional<std::uint64_t> seed,
                                    const std::optional<World>& world) {
  begin_episode(seed, world);
  restart_schedule();
  const EpisodeState& state = simulation_.shown().state();
  if (state.failed_at_reset()) {
    throw std::runtime_error(std::string(kResetFailed) + ": " + state.error);
  }
  return state;
}

std::unique_ptr<Schedule> make_schedule(const ServerOptions& options, Simulation& simulation) {
  if (options.mode == Mode::lockstep) return std::make_unique<LockstepSchedule>(simulation);
  if (!options.publish_clock && ros::Time::isSimTime()) {
    return std::make_unique<FollowSchedule>(options, simulation);
  }
  return std::make_unique<FreeSchedule>(options, simulation);
}

}  // namespace walker
