// Blocking TCP connection of a client, with deadlines.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <stdexcept>
#include <string>

#include "wire/channel.h"

namespace walker {

/// Time of the monotonic clock, which changes of the system time do not affect.
using TimePoint = std::chrono::steady_clock::time_point;

/// Period at which a call that blocks or transfers data checks for a signal.
constexpr std::chrono::milliseconds kSignalCheckPeriod{100};

/// `is_interrupted` of a call that no signal ends.
inline const std::function<bool()> kNeverInterrupted;

/// Time limit of a call. The call checks it before each wait and each piece of data.
class Deadline {
 public:
  /// @param is_interrupted as in ClientOptions; must outlive this
  Deadline(TimePoint until, const std::function<bool()>& is_interrupted)
      : until_(until), is_interrupted_(is_interrupted) {}

  explicit Deadline(TimePoint until) : Deadline(until, kNeverInterrupted) {}

  /// Also checks for a signal, every kSignalCheckPeriod.
  /// @return upper bound of a wait before the next check; above zero
  /// @throws SocketError at the deadline, Interrupted
  TimePoint::duration check() const;

  /// Returns the earlier of two deadlines: after `longest`, or after half of the remaining time.
  Deadline within(TimePoint::duration longest) const;

  /// Call this after EINTR. @throws Interrupted if the signal ends the call
  void take_signal() const;

 private:
  TimePoint until_;
  const std::function<bool()>& is_interrupted_;
  mutable TimePoint next_check_ = std::chrono::steady_clock::now() + kSignalCheckPeriod;
};

/// Failure to connect, send or receive. The message does not name the peer; the caller adds it.
struct SocketError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A connected TCP socket without Nagle's delay, or the memory that a server on this machine shares
/// (wire/channel.h). No method raises SIGPIPE. After EINTR a method continues, unless the signal
/// ends the call.
class Socket {
 public:
  /// Tries each address of the host. Resolving its name may exceed the deadline, since
  /// getaddrinfo() takes no timeout.
  /// @throws SocketError, Interrupted, as do the methods
  Socket(const std::string& host, std::uint16_t port, const Deadline& deadline);
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  ~Socket();

  void send_all(const void* data, std::size_t size, const Deadline& deadline);

  /// Blocks until bytes arrive.
  /// @return their number, at most `capacity`; 0 at EOF
  std::size_t receive(void* data, std::size_t capacity, const Deadline& deadline);

  /// Receives what has arrived, without blocking.
  /// @return the number of bytes, at most `capacity`; 0 if there are none, also at EOF or an error,
  ///         which `receive` reports
  std::size_t receive_arrived(void* data, std::size_t capacity);

 private:
  Channel channel_;
};

}  // namespace walker
