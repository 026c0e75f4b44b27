#include "wire/socket.h"

#include <fcntl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/types.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <memory>
#include <system_error>

#include "base/posix.h"
#include "walker_sim/client.h"

namespace walker {
namespace {

// Timeout of recv(). Shorter than kSignalCheckPeriod, so that a fast answer needs no poll in
// `receive`.
constexpr std::chrono::milliseconds kMaxReceive = kSignalCheckPeriod / 2;

// Upper bound of the wait for the server's memory. The server sends it when it accepts the client,
// which it does between steps.
constexpr std::chrono::milliseconds kMaxHandover{500};

[[noreturn]] void fail(int error) { throw SocketError(std::generic_category().message(error)); }

/// Blocks until the descriptor is ready.
/// @throws SocketError at the deadline, Interrupted
void wait_for(int descriptor, short events, const Deadline& deadline) {
  while (true) {
    const auto longest = std::chrono::ceil<std::chrono::milliseconds>(deadline.check());
    pollfd entry{descriptor, events, 0};
    const int ready = poll(&entry, 1, static_cast<int>(longest.count()));
    if (ready > 0) return;
    if (ready < 0) {
      if (errno != EINTR) fail(errno);
      deadline.take_signal();
    }
  }
}

/// Makes recv() block with a timeout, which saves a poll per answer.
void wait_in_receive(int descriptor) {
  const timeval timeout{0, std::chrono::microseconds(kMaxReceive).count()};
  if (setsockopt(descriptor, SOL_SOCKET, SO_RCVTIMEO, &timeout, sizeof(timeout)) != 0 ||
      fcntl(descriptor, F_SETFL, 0) != 0) {
    fail(errno);
  }
}

/// @return a connected file descriptor @throws SocketError, Interrupted
int connect_to(const addrinfo& address, const Deadline& deadline) {
  const int descriptor =
      above_standard(socket(address.ai_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (descriptor < 0) fail(errno);
  try {
    if (connect(descriptor, address.ai_addr, address.ai_addrlen) != 0) {
      if (errno != EINPROGRESS && errno != EINTR) fail(errno);
      wait_for(descriptor, POLLOUT, deadline);
      int outcome = 0;
      socklen_t size = sizeof(outcome);
      if (getsockopt(descriptor, SOL_SOCKET, SO_ERROR, &outcome, &size) != 0) fail(errno);
      if (outcome != 0) fail(outcome);
    }
    const int yes = 1;
    if (address.ai_family != AF_UNIX &&
        setsockopt(descriptor, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof(yes)) != 0) {
      fail(errno);
    }
    wait_in_receive(descriptor);
  } catch (...) {
    close(descriptor);
    throw;
  }
  return descriptor;
}

bool is_loopback(const sockaddr& address) {
  if (address.sa_family == AF_INET6) {
    return IN6_IS_ADDR_LOOPBACK(&reinterpret_cast<const sockaddr_in6&>(address).sin6_addr);
  }
  constexpr in_addr_t kNetwork = 127U << 24U;
  return address.sa_family == AF_INET &&
         (ntohl(reinterpret_cast<const sockaddr_in&>(address).sin_addr.s_addr) & 0xFF000000U) ==
             kNetwork;
}

/// Joins the server's memory by the local socket beside a port of this machine. A server of another
/// user is not trusted, because any user can take the name of a port that has none.
/// @return not open if there is no such socket, or no memory arrives in time @throws Interrupted
Channel connect_locally(const addrinfo& address, std::uint16_t port, const Deadline& deadline) {
  if (!is_loopback(*address.ai_addr)) return {};
  LocalAddress local(port);
  addrinfo wanted{};
  wanted.ai_family = AF_UNIX;
  wanted.ai_addr = local.get();
  wanted.ai_addrlen = local.size();
  try {
    Channel connected(connect_to(wanted, deadline));
    ucred peer{};
    socklen_t size = sizeof(peer);
    const bool is_known =
        getsockopt(connected.descriptor(), SOL_SOCKET, SO_PEERCRED, &peer, &size) == 0;
    if (!is_known || (peer.uid != geteuid() && peer.uid != 0)) return {};
    wait_for(connected.descriptor(), POLLIN, deadline.within(kMaxHandover));
    return Channel::join(std::move(connected));
  } catch (const SocketError&) {  // TCP remains
    return {};
  }
}

}  // namespace

TimePoint::duration Deadline::check() const {
  const TimePoint now = std::chrono::steady_clock::now();
  if (now >= until_) throw SocketError("timed out");
  if (now >= next_check_) {
    next_check_ = now + kSignalCheckPeriod;
    take_signal();
  }
  return std::min(until_, next_check_) - now;
}

Deadline Deadline::within(TimePoint::duration longest) const {
  const TimePoint now = std::chrono::steady_clock::now();
  return {now + std::min(longest, (until_ - now) / 2), is_interrupted_};
}

void Deadline::take_signal() const {
  if (is_interrupted_ && is_interrupted_()) throw Interrupted();
}

Socket::Socket(const std::string& host, std::uint16_t port, const Deadline& deadline) {
  addrinfo wanted{};
  wanted.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  const int failed = getaddrinfo(host.c_str(), std::to_string(port).c_str(), &wanted, &found);
  if (failed != 0) throw SocketError(gai_strerror(failed));
  const std::unique_ptr<addrinfo, void (*)(addrinfo*)> addresses(found, freeaddrinfo);
  std::string error;
  for (const addrinfo* address = found; address != nullptr; address = address->ai_next) {
    try {
      channel_ = connect_locally(*address, port, deadline);
      if (!channel_.is_open()) channel_ = Channel(connect_to(*address, deadline));
      return;
    } catch (const SocketError& unreachable) {
      error = unreachable.what();
    }
  }
  throw SocketError(error);
}

Socket::~Socket() = default;

void Socket::send_all(const void* data, std::size_t size, const Deadline& deadline) {
  const auto* next = static_cast<const std::uint8_t*>(data);
  while (size > 0) {
    deadline.check();
    const ssize_t sent = channel_.is_shared()
                             ? channel_.write(next, size)
                             : send(channel_.descriptor(), next, size, MSG_NOSIGNAL | MSG_DONTWAIT);
    if (sent >= 0) {
      next += sent;
      size -= static_cast<std::size_t>(sent);
    } else if (errno == EAGAIN) {
      if (!channel_.await_room()) continue;
      wait_for(channel_.descriptor(), channel_.is_shared() ? POLLIN : POLLOUT, deadline);
      channel_.take_wakeup();
    } else if (errno != EINTR) {
      fail(errno);
    }
  }
}

std::size_t Socket::receive(void* data, std::size_t capacity, const Deadline& deadline) {
  while (true) {
    // recv() could block beyond the deadline or the next check for a signal.
    const bool is_due = deadline.check() < kMaxReceive;
    if (channel_.is_shared() ? channel_.await_input() : is_due) {
      wait_for(channel_.descriptor(), POLLIN, deadline);
      channel_.take_wakeup();
    }
    const ssize_t received = channel_.read(data, capacity);
    if (received >= 0) return static_cast<std::size_t>(received);
    if (errno == EINTR) {
      deadline.take_signal();
    } else if (errno != EAGAIN) {
      fail(errno);
    }
  }
}

std::size_t Socket::receive_arrived(void* data, std::size_t capacity) {
  const ssize_t received = channel_.is_shared()
                               ? channel_.read(data, capacity)
                               : recv(channel_.descriptor(), data, capacity, MSG_DONTWAIT);
  return static_cast<std::size_t>(std::max<ssize_t>(received, 0));
}

}  // namespace walker
