// Simulation time that nobody else uses, reserved ahead.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

namespace walker {

/// Keeps a stretch of time reserved ahead of the one that uses it, which may be killed at any time:
/// who comes after it begins above all that was reserved. All times in nanoseconds.
///
/// A thread of its own renews the reservation while half of it is left, ten seconds of wall time at
/// the present pace. Whoever keeps it may be silent for as long without anything being lost. After
/// that stepping has precedence over the promise: time is used that is not reserved.
class TimeReservation {
 public:
  /// Reserves up to a time, or throws a std::exception that says why that cannot be. Called in the
  /// thread, and once more at the end.
  using Write = std::function<void(std::uint64_t until)>;

  /// Returns once there is a reservation, or the reason why there is none.
  /// @param begin after which time is reserved
  /// @param end   there is no time after it
  TimeReservation(std::uint64_t begin, std::uint64_t end, Write write);
  TimeReservation(const TimeReservation&) = delete;
  TimeReservation& operator=(const TimeReservation&) = delete;
  /// Gives back what has not been used.
  ~TimeReservation();

  /// To be called with each new time before anybody is told it. Who is so fast that the reservation
  /// has to be waited for waits a fifth of a second at most, and that once until it is there.
  void use(std::uint64_t now);

  /// Why there is no reservation and what that means; empty where there is one.
  std::string complaint() const;

 private:
  using Clock = std::chrono::steady_clock;

  void run();
  std::uint64_t next_end() const;
  std::string attempt(std::uint64_t until) const;
  void note_success(std::uint64_t from, std::uint64_t until, Clock::time_point at);
  std::string describe_failure() const;

  const std::uint64_t end_;
  const Write write_;
  std::uint64_t now_;                      // of who uses the time
  std::atomic<std::uint64_t> renew_from_;  // up to here the thread need not be told
  mutable std::mutex mutex_;               // of what follows
  std::condition_variable wanted_;
  std::condition_variable settled_;
  std::uint64_t used_;      // as far as the thread was told
  std::uint64_t reserved_;  // confirmed
  std::uint64_t asked_;     // the most of the attempts that were not confirmed
  // The pace is counted from the last confirmed attempt.
  std::uint64_t paced_from_;
  Clock::time_point paced_at_;
  bool is_wanted_ = true;
  bool has_waited_ = false;  // since the last confirmation
  bool is_over_ = false;
  std::string failure_;  // of the last attempt
  std::chrono::milliseconds pause_{0};
  std::thread thread_;
};

}  // namespace walker
