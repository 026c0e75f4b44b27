#include "server/drive/running.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include <ros/console.h>

#include "episode/failure.h"

namespace walker {
namespace {

constexpr std::chrono::seconds kUntilNextReset{1};  // after one that failed

}  // namespace

bool RunningDrive::runs() const { return !is_paused_ && (auto_reset_ || !state().has_ended()); }

bool RunningDrive::waits_to_reset_again(Clock::time_point now) const {
  return state().failed_at_reset() && now < resets_again_at_;
}

Drive::Clock::duration RunningDrive::until_due(Clock::time_point now) const {
  if (!runs()) return kIdle;
  const Clock::duration due = waits_to_reset_again(now) ? resets_again_at_ - now : until_step(now);
  return std::clamp<Clock::duration>(due, {}, kIdle);
}

void RunningDrive::step_if_due() {
  if (!runs()) return;
  const Clock::time_point now = Clock::now();
  if (waits_to_reset_again(now)) {
    restart_schedule();  // no deadline is missed meanwhile
  } else {
    step_if_due(now);
  }
}

void RunningDrive::step() {
  if (!state().has_begun() || state().has_ended()) {
    begin_episode(std::nullopt);
  } else {
    simulation_.step_by_command();
  }
}

/// Logs the first of consecutive failures; diagnostics report all of them.
void RunningDrive::begin_episode(std::optional<std::uint64_t> seed) {
  const bool failed_before = state().failed_at_reset();
  simulation_.reset(seed);
  resets_again_at_ = Clock::now() + kUntilNextReset;
  if (failed_before || !state().failed_at_reset()) return;
  ROS_ERROR_STREAM("No episode: " << kResetFailed << ": " << state().error << "; "
                                  << (auto_reset_
                                          ? "running, it is reset again after a second, and ~reset "
                                            "begins an episode at once"
                                          : "~reset begins the next"));
}

void RunningDrive::require_steps_by_service(const std::string& service) const {
  if (is_paused_) return;
  throw std::logic_error(service + (runs()
                                        ? ": mode is free and the simulation runs; call ~pause "
                                          "first, or start with mode lockstep"
                                        : ": the episode has ended, and ~reset begins the next"));
}

std::string RunningDrive::pause() {
  return std::exchange(is_paused_, true) ? "was paused already" : "paused";
}

std::string RunningDrive::unpause() {
  if (!is_paused_) return "ran already";
  is_paused_ = false;
  restart_schedule();
  return "runs";
}

}  // namespace walker
