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

/// Polls for an event before the caller blocks. A thread that blocks leaves its core idle, and a
/// virtual machine takes 20 to 60 us to wake one (docs/transport.md).
///
/// An exponential average decides whether polling pays: it does while events come within the limit.
/// If they come later, also because another thread used the core during a yield, `poll` returns at
/// once and tries again after 16 calls, then after 32, up to 4096.
template <typename Clock = std::chrono::steady_clock>
class SpinWait {
 public:
  using Duration = std::chrono::nanoseconds;

  /// @param limit longest time that a call polls; 0: never
  explicit SpinWait(Duration limit) : limit_(limit) {}

  Duration limit() const { return limit_; }

  /// Whether the next call polls, other than as a trial.
  bool pays() const { return average_ < limit_; }

  /// Polls until `is_ready` returns true, but at most until the limit.
  /// @return whether it did; otherwise the caller blocks
  template <typename IsReady>
  bool poll(const IsReady& is_ready) {
    if (limit_ <= Duration::zero()) return false;
    const bool is_trial = !pays();
    if (is_trial && ++blocked_ < pause_) return false;
    blocked_ = 0;
    const auto start = Clock::now();
    auto now = start;
    bool has_come = false;
    // Yields first: if the peer shares this core, the event has come when the yield returns. If
    // another thread needs the core, the yield may take longer than the limit.
    do {
      sched_yield();
      now = Clock::now();
      has_come = is_ready();
    } while (!has_come && now - start < limit_);
    if (has_come && now - start < limit_) {
      average_ = is_trial ? now - start : average_ + (now - start - average_) / kWeight;
      pause_ = kMinPause;
    } else {
      average_ += (kLong * limit_ - average_) / kWeight;
      if (is_trial) pause_ = std::min(2 * pause_, kMaxPause);
    }
    return has_come;
  }

 private:
  static constexpr int kWeight = 4;  // the newest wait counts for a quarter
  static constexpr int kLong = 2;    // an event beyond the limit counts as this many limits
  static constexpr int kMinPause = 16;
  static constexpr int kMaxPause = 4096;

  Duration limit_;
  Duration average_{};  // of the waits that were polled
  int blocked_ = 0;     // calls since the last that polled
  int pause_ = kMinPause;
};

}  // namespace walker
