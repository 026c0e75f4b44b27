// Measures a bare TCP round trip: blocking sockets, fixed message sizes, no work in between.
//   walker_sim_ping_pong serve --port-file F --request-bytes N --response-bytes M
//   walker_sim_ping_pong run --port P --request-bytes N --response-bytes M --seconds S
// `serve` writes its port to F and serves one client at a time until it is killed. `run` prints one
// line of JSON.
#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdio>
#include <fstream>
#include <iostream>
#include <stdexcept>
#include <string>
#include <vector>

#include "base/checked.h"
#include "bench/arguments.h"
#include "bench/round_trips.h"

namespace walker::bench {
namespace {

std::size_t bytes(const Arguments& arguments, const char* name) {
  constexpr double kMax = 1e9;
  const double number = arguments.number(name);
  if (!(number >= 1 && number <= kMax)) {
    throw std::invalid_argument("--" + std::string(name) + " = " + arguments.text(name) +
                                "; must be 1 .. 1000000000");
  }
  return static_cast<std::size_t>(number);
}

sockaddr_in loopback(std::uint16_t port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(port);
  return address;
}

void send_at_once(int connection) {
  const int yes = 1;
  checked(setsockopt(connection, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof(yes)), "TCP_NODELAY");
}

/// @return false when the peer has gone
bool send_all(int connection, const std::vector<char>& data) {
  for (std::size_t sent = 0; sent < data.size();) {
    const ssize_t count = send(connection, &data[sent], data.size() - sent, MSG_NOSIGNAL);
    if (count <= 0) return false;
    sent += static_cast<std::size_t>(count);
  }
  return true;
}

/// @return false when the peer has gone
bool receive_all(int connection, std::vector<char>& data) {
  for (std::size_t received = 0; received < data.size();) {
    const ssize_t count = recv(connection, &data[received], data.size() - received, 0);
    if (count <= 0) return false;
    received += static_cast<std::size_t>(count);
  }
  return true;
}

void serve(const Arguments& arguments) {
  std::vector<char> request(bytes(arguments, "request-bytes"));
  const std::vector<char> response(bytes(arguments, "response-bytes"));
  const int listener = checked(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0), "socket");
  sockaddr_in address = loopback(0);
  socklen_t size = sizeof(address);
  auto* const place = reinterpret_cast<sockaddr*>(&address);
  checked(bind(listener, place, size), "bind");
  checked(listen(listener, 1), "listen");
  checked(getsockname(listener, place, &size), "getsockname");
  // The rename is atomic, so a process that waits for the file never reads a partial number.
  const std::string& file = arguments.text("port-file");
  std::ofstream(file + ".part") << ntohs(address.sin_port) << '\n';
  checked(std::rename((file + ".part").c_str(), file.c_str()), file.c_str());
  while (true) {
    const int connection = checked(accept(listener, nullptr, nullptr), "accept");
    send_at_once(connection);
    while (receive_all(connection, request) && send_all(connection, response)) {
    }
    close(connection);
  }
}

void run(const Arguments& arguments) {
  const std::vector<char> request(bytes(arguments, "request-bytes"));
  std::vector<char> response(bytes(arguments, "response-bytes"));
  RoundTrips round_trips(arguments.number("seconds"));
  const int connection = checked(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0), "socket");
  const sockaddr_in address = loopback(static_cast<std::uint16_t>(arguments.number("port")));
  checked(connect(connection, reinterpret_cast<const sockaddr*>(&address), sizeof(address)),
          "connect");
  send_at_once(connection);
  round_trips.run(
      [&] {
        if (!send_all(connection, request) || !receive_all(connection, response)) {
          throw std::runtime_error("the server has gone");
        }
      },
      [] {});
  round_trips.print();
  close(connection);
}

}  // namespace
}  // namespace walker::bench

int main(int argc, char** argv) {
  using walker::bench::Arguments;
  try {
    const std::string command = argc > 1 ? argv[1] : "";
    if (command == "serve") {
      walker::bench::serve(
          Arguments(argv + 2, argv + argc, {"port-file", "request-bytes", "response-bytes"}));
    } else if (command == "run") {
      walker::bench::run(
          Arguments(argv + 2, argv + argc, {"port", "request-bytes", "response-bytes", "seconds"}));
    } else {
      throw std::invalid_argument("usage: walker_sim_ping_pong serve|run --OPTION VALUE ...");
    }
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
  return 0;
}
