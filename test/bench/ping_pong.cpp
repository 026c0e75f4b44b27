// Measures a bare TCP round trip between two processes: fixed message sizes, no work in between.
// Polls before it blocks, as our client and server do. Prints one line of JSON.
//   walker_sim_ping_pong --request-bytes N --response-bytes M --spin-us N --seconds S
#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <stdexcept>
#include <vector>

#include "base/posix.h"
#include "base/spin_wait.h"
#include "bench/program.h"

namespace walker::bench {
namespace {

int open_socket() { return checked(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0), "socket"); }

void disable_delay(int connection) {
  const int yes = 1;
  checked(setsockopt(connection, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof(yes)), "TCP_NODELAY");
}

/// @return false after EOF or an error
bool send_all(int connection, const std::vector<char>& data) {
  for (std::size_t sent = 0; sent < data.size();) {
    const ssize_t count = send(connection, &data[sent], data.size() - sent, MSG_NOSIGNAL);
    if (count <= 0) return false;
    sent += static_cast<std::size_t>(count);
  }
  return true;
}

/// @return false after EOF or an error
bool receive_all(int connection, std::vector<char>& data, SpinWait<>& spin) {
  ssize_t received = 0;
  const bool has_come = spin.poll([&] {
    received = recv(connection, data.data(), data.size(), MSG_DONTWAIT);
    return received > 0;
  });
  const std::size_t begin = received > 0 ? static_cast<std::size_t>(received) : 0;
  const std::size_t rest = data.size() - begin;
  const bool is_complete = rest == 0 || recv(connection, data.data() + begin, rest, MSG_WAITALL) ==
                                            static_cast<ssize_t>(rest);
  if (!has_come) spin.finish();
  return is_complete;
}

void serve(int listener, std::vector<char> request, const std::vector<char>& response,
           SpinWait<> spin) {
  const int connection = checked(accept(listener, nullptr, nullptr), "accept");
  disable_delay(connection);
  while (receive_all(connection, request, spin) && send_all(connection, response)) {
  }
}

void run(const Arguments& arguments) {
  const std::vector<char> request(static_cast<std::size_t>(arguments.number("request-bytes")));
  std::vector<char> response(static_cast<std::size_t>(arguments.number("response-bytes")));
  SpinWait<> spin(std::chrono::microseconds(static_cast<int>(arguments.number("spin-us"))));
  const double seconds = arguments.number("seconds");
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof(address);
  auto* const generic = reinterpret_cast<sockaddr*>(&address);
  const int listener = open_socket();
  checked(bind(listener, generic, size), "bind");
  checked(listen(listener, 1), "listen");
  checked(getsockname(listener, generic, &size), "getsockname");
  const int connection = open_socket();
  checked(connect(connection, generic, size), "connect");
  disable_delay(connection);
  const pid_t server = checked(fork(), "fork");
  if (server == 0) {
    close(connection);  // so that the client's end gives EOF
    serve(listener, request, response, spin);
    std::_Exit(EXIT_SUCCESS);
  }
  Latencies latencies;
  const Slice slice = measure(seconds, 1, [&] {
    latencies.time([&] {
      if (!send_all(connection, request) || !receive_all(connection, response, spin)) {
        throw std::runtime_error("the server has closed the connection");
      }
    });
  });
  close(connection);
  waitpid(server, nullptr, 0);
  print(1, slice, latencies);
}

}  // namespace
}  // namespace walker::bench

int main(int argc, char** argv) {
  return walker::bench::run_program("walker_sim_ping_pong", [&] {
    walker::bench::run(
        {argv + 1, argv + argc, {"request-bytes", "response-bytes", "spin-us", "seconds"}});
  });
}
