// Paces the steps of a free-running simulation. Independent of ROS.
#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>

namespace walker {

/// Schedules the beginnings of steps with absolute deadlines on the steady clock, so that delays of
/// steps and wake-ups do not accumulate.
///
/// A step that begins less than a period late leaves the schedule unchanged. A later one drops the
/// deadlines that have passed, so that lost time is not made up in a burst: two steps are at most
/// one period closer together than planned. A machine that cannot keep up steps back to back.
class Pacer {
 public:
  using Clock = std::chrono::steady_clock;

  /// @param dt               simulation time of a step [s]
  /// @param real_time_factor simulation time over wall time; 0: as fast as possible
  Pacer(double dt, double real_time_factor)
      : dt_(dt),
        real_time_factor_(real_time_factor),
        period_(planned_period(dt, real_time_factor)) {}

  /// Sets the factor. The next step is due a new period after the last one began, or at once if
  /// that has passed. Repeated calls do not postpone the next step.
  void set_real_time_factor(double factor, Clock::time_point now) {
    const Clock::time_point last_beginning = deadline_ - period_;
    real_time_factor_ = factor;
    period_ = planned_period(dt_, factor);
    deadline_ = std::max(last_beginning + period_, now);
  }

  /// Schedules the next step one period after `now`.
  void restart(Clock::time_point now) { deadline_ = now + period_; }

  /// Time until the next step; it is due if this is zero or negative.
  Clock::duration remaining(Clock::time_point now) const { return deadline_ - now; }

  /// Schedules the next step when the due one begins.
  /// @return number of missed deadlines: those after the step's own that have also passed
  std::uint64_t step_begins(Clock::time_point now) {
    const Clock::duration late = now - deadline_;
    if (period_ == Clock::duration::zero()) {
      deadline_ = now;
      return 0;
    }
    if (late < period_) {
      deadline_ += period_;
      return 0;
    }
    deadline_ = now + period_;
    return static_cast<std::uint64_t>(late / period_);
  }

  double real_time_factor() const { return real_time_factor_; }
  /// Planned wall time between steps; zero: as fast as possible.
  Clock::duration period() const { return period_; }

 private:
  static Clock::duration planned_period(double dt, double real_time_factor) {
    if (real_time_factor == 0) return Clock::duration::zero();
    // Small factors would overflow the clock's range; short steps would round to zero.
    const std::chrono::duration<double, Clock::duration::period> exact =
        std::min(std::chrono::duration<double>(dt / real_time_factor),
                 std::chrono::duration<double>(std::chrono::hours(24 * 365)));
    return std::max(Clock::duration(std::llround(exact.count())), Clock::duration(1));
  }

  double dt_;
  double real_time_factor_;
  Clock::duration period_;
  Clock::time_point deadline_;
};

}  // namespace walker
