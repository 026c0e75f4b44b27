// Deadlines and signals on a socket that never blocks: the peer always sends or always reads.
#include "wire/socket.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <functional>
#include <future>
#include <string>

#include "client/scripted_server.h"
#include "error_message.h"
#include "walker_sim/client.h"
#include "wire/local_address.h"
#include "wire/pipes.h"

namespace walker {
namespace {

using test::Peer;
using test::ScriptedServer;

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

/// Listens on the local socket beside a port.
class LocalListener {
 public:
  explicit LocalListener(std::uint16_t port) {
    LocalAddress address(port);
    bind(descriptor_, address.get(), address.size());
    listen(descriptor_, 1);
  }
  LocalListener(const LocalListener&) = delete;
  LocalListener& operator=(const LocalListener&) = delete;
  ~LocalListener() { close(descriptor_); }

  /// Accepts the next client in a thread and returns the server's ends of its pipes.
  std::future<Channel> give_pipes_to_client() const {
    return std::async(std::launch::async, [this] {
      const int client = accept(descriptor_, nullptr, nullptr);
      const Channel pipes = give_pipes(client);
      close(client);
      return pipes;
    });
  }

  /// Accepts the next client in a thread and sends it a byte without pipes.
  std::future<void> give_a_byte_to_client() const {
    return std::async(std::launch::async, [this] {
      const int client = accept(descriptor_, nullptr, nullptr);
      EXPECT_EQ(send(client, "x", 1, 0), 1);
      close(client);
    });
  }

 private:
  int descriptor_ = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
};

class PipesTest : public testing::Test {
 protected:
  PipesTest()
      : pipes_(local_.give_pipes_to_client()), socket_("localhost", server_.port(), soon()) {
    server_end_ = pipes_.get();
  }

  ~PipesTest() override { server_end_.close(); }

  static Deadline soon() { return Deadline(std::chrono::steady_clock::now() + kHang); }

  /// Closes the server's ends, as its exit does.
  void end_server() {
    server_end_.close();
    server_end_ = {};
  }

  const ScriptedServer server_{{}};
  const LocalListener local_{server_.port()};
  std::future<Channel> pipes_;
  Socket socket_;
  Channel server_end_;
};

TEST_F(PipesTest, CarryRequestsAndAnswers) {
  socket_.send_all("request", 7, soon());
  std::array<char, 16> bytes{};
  EXPECT_EQ(read(server_end_.input, bytes.data(), bytes.size()), 7);
  EXPECT_EQ(socket_.receive_arrived(bytes.data(), bytes.size()), 0U);
  EXPECT_EQ(write(server_end_.output, "answers", 7), 7);
  EXPECT_EQ(socket_.receive(bytes.data(), bytes.size(), soon()), 7U);
  EXPECT_EQ(write(server_end_.output, "more", 4), 4);
  EXPECT_EQ(socket_.receive_arrived(bytes.data(), bytes.size()), 4U);
}

TEST_F(PipesTest, ShowTheEndOfTheServer) {
  end_server();
  socket_.send_all("x", 1, soon());  // without SIGPIPE
  char byte = 0;
  EXPECT_EQ(socket_.receive(&byte, 1, soon()), 0U);
  const std::string long_request(1 << 20, 'x');
  EXPECT_EQ(message_of<SocketError>(
                [&] { socket_.send_all(long_request.data(), long_request.size(), soon()); }),
            "Broken pipe");
}

TEST_F(PipesTest, TimeOut) {
  const auto now = [] { return Deadline(std::chrono::steady_clock::now() + kSignalCheckPeriod); };
  char byte = 0;
  EXPECT_EQ(message_of<SocketError>([&] { socket_.receive(&byte, 1, now()); }), "timed out");
  const std::string long_request(1 << 20, 'x');
  EXPECT_EQ(message_of<SocketError>(
                [&] { socket_.send_all(long_request.data(), long_request.size(), now()); }),
            "timed out");
}

/// The client cannot make the server block: each end has flags of its own.
TEST_F(PipesTest, OfTheServerDoNotBlock) {
  for (const int descriptor : {server_end_.input, server_end_.output}) {
    EXPECT_NE(fcntl(descriptor, F_GETFL) & O_NONBLOCK, 0);
  }
  for (int other = STDERR_FILENO + 1; other < 64; ++other) {
    if (other == server_end_.input || other == server_end_.output) continue;
    const int flags = fcntl(other, F_GETFL);
    if (flags >= 0) fcntl(other, F_SETFL, flags & ~O_NONBLOCK);
  }
  char byte = 0;
  EXPECT_EQ(read(server_end_.input, &byte, 1), -1);
  EXPECT_EQ(errno, EAGAIN);
}

TEST(Socket, ConnectsToThePortIfNoPipesArrive) {
  std::promise<std::string> received;
  const ScriptedServer server({[&](Peer& peer) { received.set_value(peer.take(1)); }});
  const LocalListener local(server.port());
  const std::future<void> given = local.give_a_byte_to_client();
  const Deadline deadline(std::chrono::steady_clock::now() + kHang);
  Socket socket("localhost", server.port(), deadline);
  socket.send_all("x", 1, deadline);
  EXPECT_EQ(received.get_future().get(), "x");
}

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

TEST(Socket, TimesOutWhileReceiving) {
  EXPECT_EQ(end_of_use(babble, receive_one, std::chrono::milliseconds(50)), "timed out");
}

TEST(Socket, TimesOutWhileSending) {
  EXPECT_EQ(end_of_use(swallow, send_one, std::chrono::milliseconds(50)), "timed out");
}

/// The signal arrives outside all waits, so it interrupts none.
TEST(Socket, IsInterruptedWhileTransferring) {
  const auto always = [] { return true; };
  EXPECT_THROW(end_of_use(babble, receive_one, 2 * kHang, always), Interrupted);
  EXPECT_THROW(end_of_use(swallow, send_one, 2 * kHang, always), Interrupted);
}

TEST(Socket, IsInterruptedByAnEarlierSignal) {
  const auto always = [] { return true; };
  const auto silent = [](Peer& peer) { peer.sees_end(); };
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
}  // namespace walker
