// A TCP connection of a client: blocking, with deadlines.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <stdexcept>
#include <string>

namespace walker {

/// By the clock that nobody sets.
using TimePoint = std::chrono::steady_clock::time_point;

/// Between two looks for a signal in a call that waits, or whose bytes come without end.
constexpr std::chrono::milliseconds kLookPeriod{100};

/// Of a call that no signal ends.
inline const std::function<bool()> kNeverInterrupted;

/// How long a call may last. Who waits, or takes what comes without a wait, asks before each piece.
class Deadline {
 public:
  /// @param is_interrupted as ClientOptions has it; of the caller's
  Deadline(TimePoint until, const std::function<bool()>& is_interrupted)
      : until_(until), is_interrupted_(is_interrupted) {}

  explicit Deadline(TimePoint until) : Deadline(until, kNeverInterrupted) {}

  /// Looks for a signal as well, every kLookPeriod.
  /// @return how long a wait may last before the next check; above zero
  /// @throws SocketError at the deadline, Interrupted
  TimePoint::duration check() const;

  /// To be called when a signal has interrupted a wait. @throws Interrupted
  void take_signal() const;

 private:
  TimePoint until_;
  const std::function<bool()>& is_interrupted_;
  mutable TimePoint next_look_ = std::chrono::steady_clock::now() + kLookPeriod;
};

/// Why nothing can be sent or received; who knows the peer adds whom it was about.
struct SocketError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Sends at once (no Nagle delay), never raises SIGPIPE, goes on after a signal that does not end
/// the call.
class Socket {
 public:
  /// Tries each address that the host's name has. Looking up the name may outlast the deadline, for
  /// the system's resolver knows none.
  /// @throws SocketError, Interrupted, as all that waits here
  Socket(const std::string& host, std::uint16_t port, const Deadline& deadline);
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  ~Socket();

  void send_all(const void* data, std::size_t size, const Deadline& deadline);

  /// Waits for the next bytes.
  /// @return their number, at most `capacity`; 0: the peer has closed the connection
  std::size_t receive(void* data, std::size_t capacity, const Deadline& deadline);

 private:
  int descriptor_;
};

}  // namespace walker
