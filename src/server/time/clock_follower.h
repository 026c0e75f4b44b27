// When the next step is due where another's /clock sets the pace. No ROS.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

namespace walker {

/// Compares /clock with the stamps of a simulation that follows it. All times in nanoseconds.
///
/// A step is due for each dt that /clock has gone on. Where it jumps ahead, steps are left out
/// rather than made up for by a burst. Where it is behind the stamps, because resets and single
/// steps have advanced them or because it was set back, the simulation waits: stamps never go back.
class ClockFollower {
 public:
  /// What to do now.
  struct Advice {
    /// Go on from here: the present stamp, later where steps are left out.
    std::uint64_t stamp = 0;
    std::uint64_t missed = 0;  ///< steps left out that should have been made
    bool is_due = false;       ///< a step, from `stamp` to `stamp` + dt
  };

  /// @param dt of a step [ns], above zero
  explicit ClockFollower(std::uint64_t dt) : dt_(dt) {}

  /// At the start, after a pause or a reset: what /clock goes on until the next look is not missed.
  void restart();

  /// @param clock the time of /clock; zero: there is none yet
  /// @param stamp of the present state
  Advice look(std::uint64_t clock, std::uint64_t stamp);

  /// Counts the publishers of /clock: whoever starts second is waited for without a word, for a
  /// while.
  /// @param now of wall time
  void count(std::size_t publishers, std::chrono::steady_clock::time_point now);

  /// Why nothing moves, and what to do; empty where /clock has a publisher and is at most one dt
  /// behind.
  std::string complaint() const;

 private:
  std::uint64_t dt_;
  bool has_restarted_ = true;
  std::uint64_t newest_ = 0;  // the latest time that /clock has told
  std::uint64_t clock_ = 0;
  std::uint64_t behind_ = 0;  // /clock behind the stamp
  std::optional<std::chrono::steady_clock::time_point> unpublished_since_;
  bool is_unpublished_ = false;  // for long enough to say so
};

}  // namespace walker
