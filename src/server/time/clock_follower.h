// Schedule of a simulation that follows another node's /clock. No ROS.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

namespace walker {

/// Compares /clock with the stamps of a simulation that follows it. All times in nanoseconds.
///
/// A step is due for each dt that /clock advances. If /clock jumps ahead, steps are skipped; they
/// are not made up for in a burst. If /clock is behind the stamps, because resets and single steps
/// have advanced them or because it was set back, the simulation waits: stamps never decrease.
class ClockFollower {
 public:
  struct Decision {
    /// Stamp to continue from: the present one, or a later one if steps are skipped.
    std::uint64_t stamp = 0;
    std::uint64_t missed = 0;  ///< skipped steps that should have been made
    bool is_due = false;       ///< whether a step from `stamp` to `stamp` + dt is due
  };

  /// @param dt simulation time of a step [ns], above zero
  explicit ClockFollower(std::uint64_t dt) : dt_(dt) {}

  /// Called at the start and after a pause or a reset: the next update counts no steps as missed.
  void restart();

  /// Decides on the next step.
  /// @param clock time of /clock; zero: none received yet
  /// @param stamp of the present state
  Decision update(std::uint64_t clock, std::uint64_t stamp);

  /// Records the number of publishers of /clock. If there are none, `complaint` reports it after 3
  /// s: a publisher may be starting.
  void record_publishers(std::size_t publishers, std::chrono::steady_clock::time_point now);

  /// Why the simulation waits, and the remedy; empty if /clock is published and at most one dt
  /// behind.
  std::string complaint() const;

 private:
  std::uint64_t dt_;
  bool has_restarted_ = true;
  std::uint64_t newest_ = 0;  // largest time of /clock so far
  std::uint64_t clock_ = 0;
  std::uint64_t behind_ = 0;  // of /clock behind the stamp
  std::optional<std::chrono::steady_clock::time_point> unpublished_since_;
  bool is_unpublished_ = false;  // for long enough to report it
};

}  // namespace walker
