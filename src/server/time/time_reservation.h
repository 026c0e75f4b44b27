// Simulation time that is reserved ahead of its use, and the parameter with its end.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

#include "wire/xml_rpc.h"

namespace walker {

/// The end of the simulation time that servers of one master have reserved: [s, ns]. Outside any
/// node's namespace, which launch files may clear.
constexpr const char* kReservedUntil = "/walker_sim_clock/reserved_until";

/// @param value the parameter's value on the master, which any program may have set
/// @return the time [ns]
/// @throws std::invalid_argument naming the parameter, its value and what is allowed
std::uint64_t read_reserved_until(const xml_rpc::Value& value);

/// @param time below 2^32 s [ns]
/// @return the value of the parameter, as XML-RPC
std::string to_reserved_until(std::uint64_t time);

/// Keeps time reserved ahead of its user, which may be killed at any time: its successor begins
/// above the reservation. All times in nanoseconds.
///
/// A separate thread renews the reservation once half of it is used; the other half lasts for ten
/// seconds of wall time at the present pace. A shorter outage of the master has no effect. After
/// that, stepping has precedence: time is used that is not reserved.
class TimeReservation {
 public:
  /// Reserves time up to `until`, or throws a std::exception with the reason. Called in the thread,
  /// and once more by the destructor.
  using Write = std::function<void(std::uint64_t until)>;

  /// Blocks until the first attempt has succeeded or failed.
  /// @param begin time is reserved from here on
  /// @param end   upper bound of the time
  TimeReservation(std::uint64_t begin, std::uint64_t end, Write write);
  TimeReservation(const TimeReservation&) = delete;
  TimeReservation& operator=(const TimeReservation&) = delete;
  /// Releases the unused time.
  ~TimeReservation();

  /// Called with each new time before it is published. If simulation time runs past the
  /// reservation, blocks at most 0.2 s, and only once per outage.
  void use(std::uint64_t now);

  /// Why the last attempt failed, and the consequence; empty if it succeeded.
  std::string complaint() const;

 private:
  using Clock = std::chrono::steady_clock;

  void run();
  std::uint64_t next_end() const;
  std::string attempt(std::uint64_t until) const;
  void record_success(std::uint64_t from, std::uint64_t until, Clock::time_point at);
  std::string describe_failure() const;

  const std::uint64_t end_;
  const Write write_;
  std::uint64_t now_;                      // latest time, in the user's thread
  std::atomic<std::uint64_t> renew_from_;  // up to here the thread is not woken
  mutable std::mutex mutex_;               // guards what follows
  std::condition_variable wanted_;
  std::condition_variable settled_;
  std::uint64_t used_;      // latest time, as the thread knows it
  std::uint64_t reserved_;  // confirmed
  std::uint64_t asked_;     // largest unconfirmed end
  // The pace is measured from the last confirmed attempt.
  std::uint64_t paced_from_;
  Clock::time_point paced_at_;
  bool is_wanted_ = true;
  bool has_waited_ = false;  // since the last confirmation
  bool is_over_ = false;
  std::string failure_;  // of the last attempt; empty: none
  std::chrono::milliseconds pause_{0};
  std::thread thread_;
};

}  // namespace walker
