// Pipes between a server and a client on the same machine, handed over by a local socket.
#pragma once

namespace walker {

/// The file descriptors of a connection: those of two pipes, or the same socket twice. This owns
/// nothing.
struct Channel {
  static Channel of_socket(int descriptor) { return {descriptor, descriptor}; }

  bool is_open() const { return input >= 0; }
  bool is_pipes() const { return input != output; }
  void close() const;

  int input = -1;
  int output = -1;
};

/// Makes two pipes and sends the client's ends over a local socket, without blocking. All ends are
/// non-blocking, and each has flags of its own, so the client cannot make this process block.
///
/// The client's end for requests can also be read. So a write never raises SIGPIPE in a process
/// that uses the client; the end of the answers shows that the server has closed the connection.
/// @return this process's ends; not open if it has too few file descriptors, or no /proc
Channel give_pipes(int socket);

/// Receives what `give_pipes` has sent, without blocking.
/// @return not open if something else or nothing has arrived
Channel take_pipes(int socket);

}  // namespace walker
