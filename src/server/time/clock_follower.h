// Schedule of a simulation that follows another node's /clock. No ROS.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "base/shortest_text.h"

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
  void restart() {
    has_restarted_ = true;
    behind_ = 0;
  }

  /// Decides on the next step.
  /// @param clock time of /clock; zero: none received yet
  /// @param stamp of the present state
  Decision update(std::uint64_t clock, std::uint64_t stamp) {
    newest_ = std::max(newest_, clock);
    if (newest_ == 0) return {stamp, 0, false};
    const bool has_restarted = std::exchange(has_restarted_, false);
    clock_ = clock;
    behind_ = stamp > clock ? stamp - clock : 0;
    const std::uint64_t due = behind_ > 0 ? 0 : (clock - stamp) / dt_;
    Decision decision{stamp, 0, due > 0};
    if (due > (has_restarted ? 1 : kMaxStepsToCatchUp)) {
      const std::uint64_t skipped = due - 1;
      decision.stamp += skipped * dt_;
      decision.missed = has_restarted ? 0 : skipped;
    }
    return decision;
  }

  /// Records the number of publishers of /clock. If there are none, `complaint` reports it after 3
  /// s: a publisher may be starting.
  void record_publishers(std::size_t publishers, std::chrono::steady_clock::time_point now) {
    if (publishers > 0) {
      unpublished_since_.reset();
    } else if (!unpublished_since_) {
      unpublished_since_ = now;
    }
    is_unpublished_ = unpublished_since_ && now - *unpublished_since_ >= kMaxWithoutPublisher;
  }

  /// Why the simulation waits, and the remedy; empty if /clock is published and at most one dt
  /// behind.
  std::string complaint() const {
    if (is_unpublished_) {
      return "waits for /clock, which has no publisher: start the server that publishes it, or set "
             "publish_clock = true for this one";
    }
    if (behind_ <= dt_) return "";
    const auto seconds = [](std::uint64_t time) {
      return fixed_text(static_cast<double>(time) * 1e-9, 2) + " s";
    };
    std::string text = "waits for /clock, which is " + seconds(behind_) + " behind";
    if (clock_ >= newest_) return text;
    return text + "; it was set back by " + seconds(newest_ - clock_) +
           ": start this server again to follow it from there";
  }

 private:
  // If /clock has advanced by more steps than this, all but one are skipped.
  static constexpr std::uint64_t kMaxStepsToCatchUp = 5;
  static constexpr std::chrono::seconds kMaxWithoutPublisher{3};

  std::uint64_t dt_;
  bool has_restarted_ = true;
  std::uint64_t newest_ = 0;  // largest time of /clock so far
  std::uint64_t clock_ = 0;
  std::uint64_t behind_ = 0;  // of /clock behind the stamp
  std::optional<std::chrono::steady_clock::time_point> unpublished_since_;
  bool is_unpublished_ = false;  // for long enough to report it
};

}  // namespace walker
