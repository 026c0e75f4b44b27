// When the next step of a free-running simulation is due. No ROS.
#pragma once

#include <chrono>
#include <cstdint>

namespace walker {

/// Absolute deadlines on the steady clock: no drift, whatever a step or a wake-up takes. When the
/// machine cannot keep up the schedule slips; it never makes up for lost time by a burst.
class Pacer {
 public:
  using Clock = std::chrono::steady_clock;

  /// @param dt               simulation time of a step [s]
  /// @param real_time_factor simulation time over wall time; 0: as fast as it goes
  Pacer(double dt, double real_time_factor);

  /// The next step is due one period from `now`.
  void restart(Clock::time_point now);

  /// Time until the next step is due; zero or less: it is due.
  Clock::duration remaining(Clock::time_point now) const { return deadline_ - now; }

  /// The due step has been made: schedules the next.
  void step_made(Clock::time_point now);

  bool as_fast_as_it_goes() const { return period_ == Clock::duration::zero(); }
  /// Steps that were later than one whole period.
  std::uint64_t missed_deadlines() const { return missed_; }

 private:
  Clock::duration period_;
  Clock::time_point deadline_{};
  std::uint64_t missed_ = 0;
};

}  // namespace walker
