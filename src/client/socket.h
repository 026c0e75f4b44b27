// A TCP connection of a client: blocking, with deadlines.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <stdexcept>
#include <string>

namespace walker {

/// When to give up, by the clock that nobody sets.
using Deadline = std::chrono::steady_clock::time_point;

/// How long a wait may last.
struct Patience {
  Deadline until;
  /// As ClientOptions has it; of the caller's.
  const std::function<bool()>& is_interrupted;

  /// To be called when a signal has interrupted a wait. @throws Interrupted
  void take_signal() const;
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
  /// @param patience of the connection; later deadlines are about as far ahead when they are set
  /// @throws SocketError, Interrupted, as all that waits here
  Socket(const std::string& host, std::uint16_t port, const Patience& patience);
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  ~Socket();

  void send_all(const void* data, std::size_t size, const Patience& patience);

  /// Waits for the next bytes.
  /// @return their number, at most `capacity`; 0: the peer has closed the connection
  std::size_t receive(void* data, std::size_t capacity, const Patience& patience);

 private:
  Deadline::duration longest_receive_;  // after which the system itself gives up
  int descriptor_;
};

}  // namespace walker
