// Counters, timing of steps and statistics of episodes, for diagnostics. No ROS.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "episode/walker.h"

namespace walker {

/// Counts since the start, over all environments.
struct ServerCounters {
  std::uint64_t steps = 0;
  std::uint64_t resets = 0;    ///< including restores
  std::uint64_t advances = 0;  ///< of simulation time, by one dt each
  std::uint64_t simulation_errors = 0;
  std::uint64_t refused_commands = 0;    ///< invalid effort commands, and all in lock-step
  std::uint64_t contested_commands = 0;  ///< effort commands that replaced another agent's
  std::uint64_t contested_steps = 0;     ///< calls that stepped in turns with another agent's
  std::uint64_t clamped_commands = 0;    ///< actions and efforts out of bounds
  std::uint64_t command_timeouts = 0;
  std::uint64_t missed_deadlines = 0;
  std::uint64_t pushes = 0;          ///< by hand, that act in a step
  std::uint64_t refused_pushes = 0;  ///< unknown link, wrong value, no episode
};

/// Collects the wall time of steps between two reports; never allocates memory.
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
  void step_begins(Clock::time_point now, Clock::duration period) {
    if (period == Clock::duration::zero()) {
      last_beginning_.reset();
      return;
    }
    if (last_beginning_) {
      const Clock::duration deviation = std::chrono::abs(now - *last_beginning_ - period);
      deviations_[totals_.intervals++ % kCapacity] = deviation;
      totals_.largest_deviation = std::max(totals_.largest_deviation, deviation);
    }
    last_beginning_ = now;
  }

  /// Excludes the next interval, because of a pause, a reset or another pace.
  void interrupt() { last_beginning_.reset(); }

  void step_took(Clock::duration duration) {
    ++totals_.steps;
    totals_.duration += duration;
    totals_.longest = std::max(totals_.longest, duration);
  }

  /// Returns the timing since the last report and starts anew.
  Report report() {
    const auto seconds = [](Clock::duration duration) {
      return std::chrono::duration<double>(duration).count();
    };
    Report report;
    if (totals_.intervals > 0) {
      const std::size_t count = std::min<std::uint64_t>(totals_.intervals, kCapacity);
      std::sort(deviations_.begin(), deviations_.begin() + count);
      // The smallest value that at least this many thousandths of all values do not exceed.
      const auto quantile = [&](std::size_t thousandths) {
        return seconds(deviations_[(count * thousandths + 999) / 1000 - 1]);
      };
      report.jitter =
          Jitter{quantile(500), quantile(990), quantile(999), seconds(totals_.largest_deviation)};
    }
    if (totals_.steps > 0) {
      report.duration = Duration{seconds(totals_.duration) / static_cast<double>(totals_.steps),
                                 seconds(totals_.longest)};
    }
    totals_ = {};
    return report;
  }

 private:
  /// Since the last report.
  struct Totals {
    std::uint64_t intervals = 0;
    Clock::duration largest_deviation{};
    std::uint64_t steps = 0;
    Clock::duration duration{};
    Clock::duration longest{};
  };

  std::optional<Clock::time_point> last_beginning_;
  std::array<Clock::duration, kCapacity> deviations_{};  // ring buffer
  Totals totals_;
};

/// Statistics of the last 100 episodes that ended. Episodes cut short by a reset are left out: they
/// say nothing about the walker.
class EpisodeStatistics {
 public:
  static constexpr std::size_t kCapacity = 100;

  /// All values are 0 if there are no episodes.
  struct Summary {
    std::size_t episodes = 0;  ///< at most `kCapacity`
    double return_mean = 0;
    double return_deviation = 0;  ///< population standard deviation, as NumPy's std
    double return_min = 0;
    double return_max = 0;
    double length_mean = 0;  ///< [steps]
    // Each episode counts in one of these.
    std::size_t terminated = 0;  ///< also if the same step reached the time limit
    std::size_t truncated = 0;
    std::size_t failed = 0;  ///< ended by an engine failure
  };

  /// @param state right after its last step
  void add(const EpisodeState& state) {
    End end = state.terminated ? End::terminated : End::truncated;
    if (!state.error.empty()) end = End::failed;
    const std::size_t place = count_++ % kCapacity;
    returns_(place) = state.episode_return;
    lengths_(place) = state.step;
    ends_[place] = end;
  }

  Summary summary() const {
    Summary summary;
    if (count_ == 0) return summary;
    summary.episodes = std::min<std::uint64_t>(count_, kCapacity);
    const auto count = static_cast<Eigen::Index>(summary.episodes);
    const auto returns = returns_.head(count);
    summary.return_mean = returns.mean();
    summary.return_deviation = std::sqrt((returns - summary.return_mean).square().mean());
    summary.return_min = returns.minCoeff();
    summary.return_max = returns.maxCoeff();
    summary.length_mean = lengths_.head(count).mean();
    const auto number_of = [&](End end) {
      return static_cast<std::size_t>(std::count(ends_.begin(), ends_.begin() + count, end));
    };
    summary.terminated = number_of(End::terminated);
    summary.truncated = number_of(End::truncated);
    summary.failed = number_of(End::failed);
    return summary;
  }

 private:
  enum class End { terminated, truncated, failed };

  // Ring buffers.
  Eigen::ArrayXd returns_ = Eigen::ArrayXd(kCapacity);
  Eigen::ArrayXd lengths_ = Eigen::ArrayXd(kCapacity);  // [steps]
  std::array<End, kCapacity> ends_{};
  std::uint64_t count_ = 0;
};

/// Counters and ended episodes of all environments.
struct Account {
  ServerCounters counters;
  EpisodeStatistics episodes;

  /// Counts the state after a step or a reset.
  void add(const EpisodeState& state) {
    ++(state.step == 0 ? counters.resets : counters.steps);
    if (!state.error.empty()) ++counters.simulation_errors;
    if (state.step != 0 && state.has_ended()) episodes.add(state);
  }
};

}  // namespace walker
