// Shared memory beside a socket: what it carries, and connections to the port without it.
#include "wire/channel.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <future>
#include <iterator>
#include <optional>
#include <string>
#include <vector>

#include "client/scripted_server.h"
#include "error_message.h"
#include "wire/socket.h"

namespace walker::test {
namespace {

constexpr std::chrono::seconds kHang{10};  // only a failure takes this long

/// Sends a byte with file descriptors.
void send_descriptors(int socket, const std::vector<int>& descriptors) {
  char byte = 'x';
  iovec bytes{&byte, 1};
  const std::size_t size = descriptors.size() * sizeof(int);
  std::vector<char> control(descriptors.empty() ? 0 : CMSG_SPACE(size));
  msghdr message{};
  message.msg_iov = &bytes;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  if (cmsghdr* const header = CMSG_FIRSTHDR(&message)) {
    header->cmsg_level = SOL_SOCKET;
    header->cmsg_type = SCM_RIGHTS;
    header->cmsg_len = CMSG_LEN(size);
    std::memcpy(CMSG_DATA(header), descriptors.data(), size);
  }
  EXPECT_EQ(sendmsg(socket, &message, 0), 1);
}

/// A file in memory of this size.
class MemoryFile {
 public:
  MemoryFile(off_t size, int seals) {
    EXPECT_EQ(ftruncate(descriptor_, size), 0);
    EXPECT_EQ(fcntl(descriptor_, F_ADD_SEALS, seals), 0);
  }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  ~MemoryFile() { close(descriptor_); }

  int get() const { return descriptor_; }

 private:
  int descriptor_ = memfd_create("test", MFD_CLOEXEC | MFD_ALLOW_SEALING);
};

constexpr off_t kSharedBytes = 2 * (128 + (1 << 16));  // of src/wire/channel.cpp

std::ptrdiff_t num_descriptors() {
  const std::filesystem::directory_iterator open_ones("/proc/self/fd");
  return std::distance(begin(open_ones), end(open_ones));
}

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

  /// Accepts the next client in a thread and shares memory with it. Returns the server's side.
  std::future<Channel> share_with_client() const {
    return std::async(std::launch::async, [this] {
      return Channel::share(Channel(accept(descriptor_, nullptr, nullptr)));
    });
  }

  /// Accepts the next client in a thread and sends it a byte with these file descriptors.
  std::future<void> send_to_client(const std::vector<int>& descriptors) const {
    return std::async(std::launch::async, [this, descriptors] {
      const int client = accept(descriptor_, nullptr, nullptr);
      send_descriptors(client, descriptors);
      close(client);
    });
  }

 private:
  int descriptor_ = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
};

std::string read_from(Channel& channel) {
  std::string bytes(1 << 17, '\0');
  const ssize_t size = channel.read(bytes.data(), bytes.size());
  return size < 0 ? "none" : bytes.substr(0, static_cast<std::size_t>(size));
}

class SharedMemoryTest : public testing::Test {
 protected:
  static Deadline soon() { return Deadline(std::chrono::steady_clock::now() + kHang); }

  const ScriptedServer server_{{}};
  const LocalListener local_{server_.port()};
  std::future<Channel> shared_ = local_.share_with_client();
  Socket socket_{"localhost", server_.port(), soon()};
  Channel server_end_ = shared_.get();
};

TEST_F(SharedMemoryTest, CarriesRequestsAndAnswers) {
  ASSERT_TRUE(server_end_.is_shared());
  EXPECT_EQ(read_from(server_end_), "none");
  socket_.send_all("request", 7, soon());
  EXPECT_EQ(read_from(server_end_), "request");
  std::array<char, 16> bytes{};
  EXPECT_EQ(socket_.receive_arrived(bytes.data(), bytes.size()), 0U);
  EXPECT_EQ(server_end_.write("answers", 7), 7);
  EXPECT_EQ(socket_.receive(bytes.data(), bytes.size(), soon()), 7U);
  EXPECT_EQ(server_end_.write("more", 4), 4);
  EXPECT_EQ(socket_.receive_arrived(bytes.data(), bytes.size()), 4U);
}

/// Each side waits for the other many times: for bytes and, behind full rings, for room.
TEST_F(SharedMemoryTest, CarriesMoreThanItHolds) {
  std::string sent(3 << 20, '\0');
  for (std::size_t i = 0; i < sent.size(); ++i) sent[i] = static_cast<char>(i * i >> 8U);
  const auto echo = std::async(std::launch::async, [&] {
    std::string bytes(70001, '\0');
    for (std::size_t left = sent.size(); left > 0;) {
      const ssize_t size = server_end_.read(bytes.data(), bytes.size());
      if (size <= 0) {
        pollfd entry{server_end_.descriptor(), POLLIN, 0};
        if (server_end_.await_input()) poll(&entry, 1, -1);
        server_end_.take_wakeup();
        continue;
      }
      left -= static_cast<std::size_t>(size);
      for (ssize_t given = 0; given < size;) {
        given += std::max<ssize_t>(
            server_end_.write(&bytes[static_cast<std::size_t>(given)], size_t(size - given)), 0);
      }
    }
  });
  std::string received(sent.size(), '\0');
  std::size_t size = 0;
  const std::size_t part = 100003;  // more than both rings hold would block both sides
  for (std::size_t begin = 0; begin < sent.size(); begin += part) {
    socket_.send_all(&sent[begin], std::min(part, sent.size() - begin), soon());
    const std::size_t end = std::min(begin + part, sent.size());
    while (size < end) size += socket_.receive(&received[size], end - size, soon());
  }
  EXPECT_EQ(received, sent);
}

TEST_F(SharedMemoryTest, ShowsTheEndOfTheServer) {
  EXPECT_EQ(server_end_.write("last", 4), 4);
  server_end_ = Channel();
  socket_.send_all("x", 1, soon());  // without SIGPIPE
  std::array<char, 16> bytes{};
  EXPECT_EQ(socket_.receive(bytes.data(), bytes.size(), soon()), 4U);
  EXPECT_EQ(socket_.receive(bytes.data(), bytes.size(), soon()), 0U);
  EXPECT_EQ(message_of<SocketError>([&] { socket_.send_all("x", 1, soon()); }), "Broken pipe");
}

TEST_F(SharedMemoryTest, TimesOut) {
  const auto now = [] { return Deadline(std::chrono::steady_clock::now() + kSignalCheckPeriod); };
  char byte = 0;
  EXPECT_EQ(message_of<SocketError>([&] { socket_.receive(&byte, 1, now()); }), "timed out");
  const std::string long_request(1 << 20, 'x');
  EXPECT_EQ(message_of<SocketError>(
                [&] { socket_.send_all(long_request.data(), long_request.size(), now()); }),
            "timed out");
}

/// Connects beside a local socket whose server sends this to the client.
/// @param descriptors sent with a byte; nullopt: the server accepts no client
/// @return whether the connection is to the port
bool connects_to_the_port(const std::optional<std::vector<int>>& descriptors) {
  std::promise<std::string> received;
  const ScriptedServer server({[&](Peer& peer) { received.set_value(peer.take(1)); }});
  const LocalListener local(server.port());
  const std::future<void> sent =
      descriptors ? local.send_to_client(*descriptors) : std::future<void>();
  const Deadline deadline(std::chrono::steady_clock::now() + kHang);
  Socket socket("localhost", server.port(), deadline);
  socket.send_all("x", 1, deadline);
  return received.get_future().wait_for(kHang / 2) == std::future_status::ready;
}

TEST(Socket, ConnectsToThePortIfNoMemoryArrives) {
  EXPECT_TRUE(connects_to_the_port(std::vector<int>{}));
  EXPECT_TRUE(connects_to_the_port(std::nullopt));
}

/// A server could shrink it later, and access beyond its end would be fatal.
TEST(Socket, ConnectsToThePortIfTheMemoryIsNotSealed) {
  const MemoryFile growing(kSharedBytes, F_SEAL_GROW);
  EXPECT_TRUE(connects_to_the_port(std::vector<int>{growing.get()}));
}

TEST(Socket, KeepsNoDescriptorThatAServerSends) {
  const MemoryFile sealed(kSharedBytes, F_SEAL_SHRINK);
  const std::ptrdiff_t before = num_descriptors();
  for (std::size_t count = 1; count < 4; ++count) {
    const ScriptedServer server({});
    const LocalListener local(server.port());
    const std::future<void> sent = local.send_to_client(std::vector<int>(count, sealed.get()));
    const Socket socket("localhost", server.port(),
                        Deadline(std::chrono::steady_clock::now() + kHang));
  }
  EXPECT_EQ(num_descriptors(), before);
}

}  // namespace
}  // namespace walker::test
