// When the next step of a free-running simulation is due. No ROS.
#pragma once

#include <chrono>
#include <cstdint>

#include "walker_sim/export.h"

namespace walker {

/// A schedule of the beginnings of steps: absolute deadlines on the steady clock, so that nothing
/// drifts, whatever a step or a wake-up takes.
///
/// A step that begins less than a period late leaves the schedule as it is. One that begins later
/// drops the deadlines that have passed, so that lost time is never made up for by a burst: two
/// steps are at most one period closer together than planned, and a machine that cannot keep up
/// makes one step after the other.
class WALKER_SIM_EXPORT Pacer {
 public:
  using Clock = std::chrono::steady_clock;

  /// @param dt               simulation time of a step [s]
  /// @param real_time_factor simulation time over wall time; 0: as fast as it goes
  Pacer(double dt, double real_time_factor);

  /// Changes the pace from the step that began last: the next one is due a new period after it, or
  /// at once where that has passed. Steps go on also when this is called without end.
  void set_real_time_factor(double factor, Clock::time_point now);

  /// The next step is due one period from `now`.
  void restart(Clock::time_point now);

  /// Time until the next step is due; zero or less: it is due.
  Clock::duration remaining(Clock::time_point now) const { return deadline_ - now; }

  /// The due step begins: schedules the next. @return missed deadlines: those after the step's own
  /// that have passed as well
  std::uint64_t step_begins(Clock::time_point now);

  double real_time_factor() const { return real_time_factor_; }
  /// Wall time from step to step as planned; zero: as fast as it goes.
  Clock::duration period() const { return period_; }

 private:
  double dt_;
  double real_time_factor_;
  Clock::duration period_;
  Clock::time_point deadline_;
};

}  // namespace walker
