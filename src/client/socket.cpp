#include "client/socket.h"

#include <fcntl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/types.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <limits>
#include <memory>
#include <system_error>

#include "walker_sim/client.h"

namespace walker {
namespace {

[[noreturn]] void fail(int error) { throw SocketError(std::generic_category().message(error)); }

/// Waits until the socket is ready. @throws SocketError at the deadline, Interrupted
void wait_for(int descriptor, short events, const Patience& patience) {
  while (true) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(patience.until -
                                                                   std::chrono::steady_clock::now())
                          .count();
    constexpr std::int64_t kLongest = std::numeric_limits<int>::max();
    pollfd entry{descriptor, events, 0};
    const int ready =
        poll(&entry, 1, static_cast<int>(std::clamp<std::int64_t>(left, 0, kLongest)));
    if (ready > 0) return;
    if (ready < 0) {
      if (errno != EINTR) fail(errno);
      patience.take_signal();
    }
    if (ready == 0 && left <= 0) throw SocketError("timed out");
  }
}

/// Lets the socket itself wait in a receive, which spares each answer a poll.
void wait_in_receive(int descriptor, Deadline::duration longest) {
  const auto microseconds = std::chrono::duration_cast<std::chrono::microseconds>(longest).count();
  if (microseconds <= 0) throw SocketError("timed out");  // zero would stand for endless patience
  constexpr std::int64_t kPerSecond = 1000000;
  const timeval timeout{microseconds / kPerSecond, microseconds % kPerSecond};
  if (setsockopt(descriptor, SOL_SOCKET, SO_RCVTIMEO, &timeout, sizeof(timeout)) != 0 ||
      fcntl(descriptor, F_SETFL, 0) != 0) {
    fail(errno);
  }
}

/// @return the connected socket
/// @throws SocketError, Interrupted
int connect_to(const addrinfo& address, const Patience& patience,
               Deadline::duration longest_receive) {
  const int descriptor = socket(address.ai_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (descriptor < 0) fail(errno);
  try {
    if (connect(descriptor, address.ai_addr, address.ai_addrlen) != 0) {
      if (errno != EINPROGRESS && errno != EINTR) fail(errno);
      wait_for(descriptor, POLLOUT, patience);
      int outcome = 0;
      socklen_t size = sizeof(outcome);
      if (getsockopt(descriptor, SOL_SOCKET, SO_ERROR, &outcome, &size) != 0) fail(errno);
      if (outcome != 0) fail(outcome);
    }
    const int yes = 1;
    if (setsockopt(descriptor, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof(yes)) != 0) fail(errno);
    wait_in_receive(descriptor, longest_receive);
  } catch (...) {
    close(descriptor);
    throw;
  }
  return descriptor;
}

}  // namespace

void Patience::take_signal() const {
  if (is_interrupted && is_interrupted()) throw Interrupted();
}

Socket::Socket(const std::string& host, std::uint16_t port, const Patience& patience)
    : longest_receive_(patience.until - std::chrono::steady_clock::now()) {
  addrinfo wanted{};
  wanted.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  const int failed = getaddrinfo(host.c_str(), std::to_string(port).c_str(), &wanted, &found);
  if (failed != 0) throw SocketError(gai_strerror(failed));
  const std::unique_ptr<addrinfo, void (*)(addrinfo*)> addresses(found, freeaddrinfo);
  std::string error;
  for (const addrinfo* address = found; address != nullptr; address = address->ai_next) {
    try {
      descriptor_ = connect_to(*address, patience, longest_receive_);
      return;
    } catch (const SocketError& unreachable) {
      error = unreachable.what();
    }
  }
  throw SocketError(error);
}

Socket::~Socket() { close(descriptor_); }

void Socket::send_all(const void* data, std::size_t size, const Patience& patience) {
  const auto* next = static_cast<const std::uint8_t*>(data);
  while (size > 0) {
    const ssize_t sent = send(descriptor_, next, size, MSG_NOSIGNAL | MSG_DONTWAIT);
    if (sent >= 0) {
      next += sent;
      size -= static_cast<std::size_t>(sent);
    } else if (errno == EAGAIN) {
      wait_for(descriptor_, POLLOUT, patience);
    } else if (errno != EINTR) {
      fail(errno);
    }
  }
}

std::size_t Socket::receive(void* data, std::size_t capacity, const Patience& patience) {
  while (true) {
    // Where much of the time has passed already, the socket's own patience would be too long.
    const Deadline::duration left = patience.until - std::chrono::steady_clock::now();
    if (left < longest_receive_ * 99 / 100) wait_for(descriptor_, POLLIN, patience);
    const ssize_t received = recv(descriptor_, data, capacity, 0);
    if (received >= 0) return static_cast<std::size_t>(received);
    if (errno == EINTR) {
      patience.take_signal();
    } else if (errno != EAGAIN) {
      fail(errno);
    }
  }
}

}  // namespace walker
