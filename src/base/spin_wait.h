// A wait that begins with polling, as long as that pays.
#pragma once

#include <sched.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <utility>

#include "walker_sim/export.h"

namespace walker {

constexpr int kMaxSpinMicroseconds = 1000;
constexpr int kMeasuredSpin = -1;  // instead of a number of microseconds

/// Returns the limit of a setting in microseconds. `kMeasuredSpin` stands for twenty times what
/// waking a blocked thread takes on this machine, measured at its first use in 2 ms, but 50 to
/// 1000 us: an event that comes later loses little if the thread has blocked.
WALKER_SIM_EXPORT std::chrono::microseconds spin_limit(std::int64_t microseconds);

/// Polls for an event before the caller blocks, or blocks at once, whichever makes waits shorter. A
/// thread that blocks leaves its core idle, and a virtual machine takes 20 to 60 us to wake one
/// (docs/transport.md). But where a third thread needs a core, polling keeps the peer from it: in
/// another session a yield does not let the peer run (Linux' autogroups).
///
/// The other way is tried for 8 waits in a row: after 64 waits, then after twice as many, up to
/// 8192. It is kept if they were shorter on average than those since the last trial. Polling ends
/// at once if an exponential average of the waits exceeds the limit.
template <typename Clock = std::chrono::steady_clock>
class SpinWait {
 public:
  using Duration = std::chrono::nanoseconds;

  /// @param limit longest time that a call polls; 0: never
  explicit SpinWait(Duration limit) : limit_(limit), polls_(limit > Duration::zero()) {}

  Duration limit() const { return limit_; }

  /// Whether polling is the present way.
  bool pays() const { return polls_; }

  /// Begins a wait: polls until `is_ready` returns true, but at most until the limit.
  /// @return whether it did; otherwise the caller blocks, and then calls `finish`
  template <typename IsReady>
  bool poll(const IsReady& is_ready) {
    if (limit_ <= Duration::zero()) return false;
    begin_ = Clock::now();
    if (polls_ == is_trial_) return false;
    auto now = begin_;
    bool has_come = false;
    // Yields first: if the peer shares this core, the event has come when the yield returns. If
    // another thread needs the core, the yield may take longer than the limit.
    do {
      sched_yield();
      now = Clock::now();
      has_come = is_ready();
    } while (!has_come && now - begin_ < limit_);
    if (has_come) record(now - begin_);
    return has_come;
  }

  /// Ends a wait that has blocked.
  void finish() {
    if (limit_ > Duration::zero()) record(Clock::now() - begin_);
  }

 private:
  void record(Duration wait) {
    wait = std::min(wait, kLong * limit_);  // the caller's peer may pause for seconds
    ++waits_;
    total_ += wait;
    average_ += (wait - average_) / kWeight;
    if (is_trial_) {
      if (waits_ == kTrialWaits) conclude(restart());
    } else if (polls_ && average_ > limit_) {
      restart();
      change();
    } else if (waits_ >= until_trial_) {
      usual_ = restart();
      is_trial_ = true;
    }
  }

  /// Begins a trial, or the waits between two. @return the mean of the waits before
  Duration restart() { return std::exchange(total_, {}) / std::exchange(waits_, 0); }

  void conclude(Duration trial) {
    is_trial_ = false;
    if (trial < usual_ && (polls_ || trial < limit_)) {
      change();
    } else {
      until_trial_ = std::min(2 * until_trial_, kMaxUntilTrial);
    }
  }

  void change() {
    polls_ = !polls_;
    until_trial_ = kMinUntilTrial;
  }

  static constexpr int kWeight = 4;  // the newest wait counts for a quarter
  static constexpr int kLong = 2;    // a longer wait counts as this many limits
  static constexpr int kTrialWaits = 8;
  static constexpr int kMinUntilTrial = 64;
  static constexpr int kMaxUntilTrial = 8192;

  Duration limit_;
  typename Clock::time_point begin_;  // of the present wait
  bool polls_;                        // the present way: else it blocks
  bool is_trial_ = false;             // of the other way
  Duration average_{};                // exponential, of the waits
  Duration usual_{};                  // mean of the waits between the last two trials
  Duration total_{};                  // of the waits in the trial, or since the last one
  int waits_ = 0;                     // their number
  int until_trial_ = kMinUntilTrial;
};

}  // namespace walker
