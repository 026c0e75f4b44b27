// Deadlines and signals on a socket that never blocks: the peer always sends or always reads.
#include "wire/socket.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <chrono>
#include <functional>
#include <string>

#include "client/scripted_server.h"
#include "error_message.h"
#include "walker_sim/client.h"

namespace walker::test {
namespace {

constexpr std::chrono::seconds kHang{10};  // only a failure takes this long

using Use = std::function<void(Socket&, const Deadline&)>;

/// Uses a connection to a peer repeatedly, for kHang at most.
/// @return the message of the SocketError that ends it, or "nothing thrown"
std::string end_of_use(const ScriptedServer::Script& peer, const Use& use,
                       std::chrono::milliseconds timeout,
                       const std::function<bool()>& is_interrupted = kNeverInterrupted) {
  const ScriptedServer server({peer});
  const auto begin = std::chrono::steady_clock::now();
  const Deadline deadline{begin + timeout, is_interrupted};
  Socket socket("127.0.0.1", server.port(), deadline);
  return message_of<SocketError>([&] {
    while (std::chrono::steady_clock::now() < begin + kHang) use(socket, deadline);
  });
}

/// Keeps the client from blocking: sends more at a time than the client reads.
void babble(Peer& peer) {
  const std::string words(1 << 16, 'x');
  while (!peer.has_ended()) peer.give(words);
}

void swallow(Peer& peer) {
  std::string words(1 << 16, '\0');
  while (peer.take(words)) continue;
}

void receive_one(Socket& socket, const Deadline& deadline) {
  char byte = 0;
  socket.receive(&byte, 1, deadline);
}

void send_one(Socket& socket, const Deadline& deadline) { socket.send_all("x", 1, deadline); }

/// Otherwise the server would receive what the process prints.
TEST(Socket, AvoidsClosedStandardDescriptors) {
  const int listener = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  socklen_t size = sizeof(address);
  ASSERT_EQ(listen(listener, 1), 0);  // binds to any free port
  ASSERT_EQ(getsockname(listener, reinterpret_cast<sockaddr*>(&address), &size), 0);
  std::array<int, 3> saved{};
  for (int standard = 0; standard <= STDERR_FILENO; ++standard) {
    saved[standard] = fcntl(standard, F_DUPFD_CLOEXEC, STDERR_FILENO + 1);
    close(standard);
  }
  std::array<bool, 3> is_taken{};
  {
    const Deadline deadline(std::chrono::steady_clock::now() + kHang);
    const Socket socket("127.0.0.1", ntohs(address.sin_port), deadline);
    for (int standard = 0; standard <= STDERR_FILENO; ++standard) {
      is_taken[standard] = fcntl(standard, F_GETFD) != -1;
    }
  }
  for (int standard = 0; standard <= STDERR_FILENO; ++standard) {
    dup2(saved[standard], standard);
    close(saved[standard]);
  }
  close(listener);
  EXPECT_EQ(is_taken, (std::array<bool, 3>{}));
}

TEST(Socket, TimesOutWhileTransferring) {
  constexpr std::chrono::milliseconds kTimeout{50};
  EXPECT_EQ(end_of_use(babble, receive_one, kTimeout), "timed out");
  EXPECT_EQ(end_of_use(swallow, send_one, kTimeout), "timed out");
}

/// The signal arrives outside all waits, so it interrupts none.
TEST(Socket, IsInterruptedByAnEarlierSignal) {
  const auto always = [] { return true; };
  const auto silent = [](Peer& peer) { peer.sees_end(); };
  EXPECT_THROW(end_of_use(babble, receive_one, 2 * kHang, always), Interrupted);
  EXPECT_THROW(end_of_use(swallow, send_one, 2 * kHang, always), Interrupted);
  EXPECT_THROW(end_of_use(silent, receive_one, kHang, always), Interrupted);
}

/// The check costs time, so the socket does not make it for every piece.
TEST(Socket, ChecksForSignalsPeriodically) {
  std::atomic<int> looks{0};
  const std::function<bool()> count = [&] {
    ++looks;
    return false;
  };
  constexpr int kPeriods = 5;
  EXPECT_EQ(end_of_use(babble, receive_one, kPeriods * kSignalCheckPeriod, count), "timed out");
  EXPECT_LE(looks, kPeriods);
}

}  // namespace
}  // namespace walker::test
