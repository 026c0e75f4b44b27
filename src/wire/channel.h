// A connection between a client and a server: a socket, and on one machine shared memory.
#pragma once

#include <sys/socket.h>
#include <sys/types.h>
#include <sys/un.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>

namespace walker {

struct SharedRing;

/// Address of the local socket beside a TCP port, which shares memory. The name is in Linux's
/// abstract namespace, so that it ends with its socket and needs no file.
class LocalAddress {
 public:
  explicit LocalAddress(std::uint16_t port) {
    const std::string name = "walker_sim/" + std::to_string(port);
    address_.sun_family = AF_UNIX;
    std::copy(name.begin(), name.end(), address_.sun_path + 1);  // after a 0: abstract
    size_ = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + name.size());
  }

  sockaddr* get() { return reinterpret_cast<sockaddr*>(&address_); }
  socklen_t size() const { return size_; }

 private:
  sockaddr_un address_{};
  socklen_t size_;
};

/// A stream of bytes in each direction. Sockets carry them, or two rings in memory that both
/// processes map; then a local socket carries only bytes that wake the peer, and shows its end.
///
/// Before the caller of a channel with shared memory blocks until `descriptor` is readable, it
/// calls `await_input` or `await_room`, and afterwards `take_wakeup`. The peer may write anything
/// into the shared memory: this process copies what it reads and keeps its own positions.
class Channel {
 public:
  Channel() = default;
  /// @param socket connected; the channel owns it
  explicit Channel(int socket) : socket_(socket) {}
  Channel(Channel&& other) noexcept;
  Channel& operator=(Channel&& other) noexcept;
  ~Channel();

  /// As a server, makes shared memory and sends it over a local socket, without blocking.
  /// @return not open if the system has no such memory or file descriptor left
  static Channel share(Channel local);
  /// As a client, receives that memory, without blocking.
  /// @return not open if something else or nothing has arrived
  static Channel join(Channel local);

  bool is_open() const { return socket_ >= 0; }
  bool is_shared() const { return input_ != nullptr; }
  int descriptor() const { return socket_; }

  /// As read() and write() of a non-blocking socket, without SIGPIPE. In shared memory they make no
  /// system call, unless the peer waits.
  ssize_t read(void* data, std::size_t size);
  ssize_t write(const void* data, std::size_t size);

  // Sockets have none of what follows: poll() reports their events.
  /// Whether `read` has bytes or the end of the stream.
  bool has_input() const;
  /// Whether `write` takes a byte, or finds that the peer has ended.
  bool has_room() const;
  // Each asks the peer to wake this process, and returns false if there is no need to wait.
  bool await_input();
  bool await_room();
  /// Takes the bytes that have woken this process; notices the peer's end.
  void take_wakeup();

 private:
  void add_memory(void* memory, SharedRing& input, SharedRing& output);
  void wake_peer() const;
  void close();

  int socket_ = -1;
  void* memory_ = nullptr;  // null: none is shared
  SharedRing* input_ = nullptr;
  SharedRing* output_ = nullptr;
  std::uint32_t read_ = 0;     // bytes, modulo 2^32
  std::uint32_t written_ = 0;  // bytes, modulo 2^32
  bool is_at_end_ = false;
};

}  // namespace walker
