// A wait that begins with polling, as long as that pays.
#pragma once

#include <sched.h>

#include <algorithm>
#include <chrono>
#include <cstdint>

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
/// The present way is kept while an exponential average of its waits is below the limit, if it
/// polls, and the other way is tried for 8 waits in a row: after 64 waits, then after twice as
/// many, up to 8192. Polling that exceeds the limit on average ends at once.
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
    if (is_trial_) {
      trial_ += wait / kTrialWaits;
      if (waits_ == kTrialWaits) conclude();
      return;
    }
    average_ += (wait - average_) / kWeight;
    if (polls_ && average_ > limit_) {
      change();
    } else if (waits_ >= until_trial_) {
      is_trial_ = true;
      waits_ = 0;
      trial_ = Duration::zero();
    }
  }

  void conclude() {
    const bool is_better = trial_ < average_ && (polls_ || trial_ < limit_);
    until_trial_ = std::min(2 * until_trial_, kMaxUntilTrial);
    is_trial_ = false;
    waits_ = 0;
    if (!is_better) return;
    change();
    average_ = trial_;
  }

  void change() {
    polls_ = !polls_;
    waits_ = 0;
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
  Duration average_{};                // of the waits in the present way
  Duration trial_{};                  // mean of the trial's waits
  int waits_ = 0;                     // in the trial, or since the last one
  int until_trial_ = kMinUntilTrial;
};

}  // namespace walker
