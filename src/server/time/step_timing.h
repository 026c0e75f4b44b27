// How evenly steps follow each other and how long they take, in wall time. No ROS.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace walker {

/// Gathers the timing of steps between two reports; nothing is allocated.
class StepTiming {
 public:
  using Clock = std::chrono::steady_clock;
  /// The quantiles of a report are of this many intervals at most, the latest.
  static constexpr std::size_t kCapacity = 4096;

  /// Deviations of the intervals between the beginnings of steps from the planned period, whether
  /// too short or too long [s].
  struct Jitter {
    double median;
    double percentile_99;
    double percentile_999;  ///< of a thousand
    double largest;         ///< of all intervals since the last report
  };
  /// Wall time of the steps themselves [s].
  struct Duration {
    double mean;
    double largest;
  };
  struct Report {
    std::optional<Jitter> jitter;      ///< none without two steps in sequence at a planned period
    std::optional<Duration> duration;  ///< none without a step
  };

  /// A step begins at `now` as planned `period` after the one before; period zero: not planned.
  void step_begins(Clock::time_point now, Clock::duration period);

  /// The next step does not follow the last one: after a pause, a reset or at another pace.
  void interrupt() { last_beginning_.reset(); }

  /// A step of the environment has taken this long.
  void step_took(Clock::duration duration);

  /// What was gathered since the last report; begins anew.
  Report report();

 private:
  std::optional<Clock::time_point> last_beginning_;
  std::array<Clock::duration, kCapacity> deviations_{};  // a ring
  std::uint64_t intervals_ = 0;
  Clock::duration largest_deviation_{};
  std::uint64_t steps_ = 0;
  Clock::duration total_{};
  Clock::duration longest_{};
};

}  // namespace walker
