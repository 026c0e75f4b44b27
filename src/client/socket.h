// A TCP connection of a client: blocking, with deadlines.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>

namespace walker {

/// When to give up, by the clock that nobody sets.
using Deadline = std::chrono::steady_clock::time_point;

/// Why nothing can be sent or received; who knows the peer adds whom it was about.
struct SocketError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Sends at once (no Nagle delay), never raises SIGPIPE, goes on after a signal.
class Socket {
 public:
  /// Tries each address that the host's name has. Looking up the name may outlast the deadline, for
  /// the system's resolver knows none.
  /// @param deadline of the connection; later ones are about as far ahead when they are set
  /// @throws SocketError
  Socket(const std::string& host, std::uint16_t port, Deadline deadline);
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  ~Socket();

  /// @throws SocketError
  void send_all(const void* data, std::size_t size, Deadline deadline);

  /// Waits for the next bytes.
  /// @return their number, at most `capacity`; 0: the peer has closed the connection
  /// @throws SocketError
  std::size_t receive(void* data, std::size_t capacity, Deadline deadline);

 private:
  Deadline::duration longest_receive_;  // after which the system itself gives up
  int descriptor_;
};

}  // namespace walker
