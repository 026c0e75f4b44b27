// Jitter and duration of steps, in wall time. No ROS.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace walker {

/// Collects the timing of steps between two reports; never allocates memory.
class StepTiming {
 public:
  using Clock = std::chrono::steady_clock;
  /// Quantiles are computed from at most this many intervals, the latest ones.
  static constexpr std::size_t kCapacity = 4096;

  /// Absolute deviations of the intervals between step beginnings from the planned period [s].
  struct Jitter {
    double median;
    double percentile_99;
    double percentile_999;  ///< 99.9th percentile
    double largest;         ///< of all intervals since the last report
  };
  /// Wall time that the steps took [s].
  struct Duration {
    double mean;
    double largest;
  };
  struct Report {
    std::optional<Jitter> jitter;      ///< none without two consecutive steps at a planned period
    std::optional<Duration> duration;  ///< none without a step
  };

  /// Records that a step begins, planned `period` after the last one; period zero: not planned.
  void step_begins(Clock::time_point now, Clock::duration period);

  /// Excludes the next interval, because of a pause, a reset or another pace.
  void interrupt() { last_beginning_.reset(); }

  void step_took(Clock::duration duration);

  /// Returns the timing since the last report and starts anew.
  Report report();

 private:
  std::optional<Clock::time_point> last_beginning_;
  std::array<Clock::duration, kCapacity> deviations_{};  // ring buffer
  std::uint64_t intervals_ = 0;
  Clock::duration largest_deviation_{};
  std::uint64_t steps_ = 0;
  Clock::duration total_{};
  Clock::duration longest_{};
};

}  // namespace walker
