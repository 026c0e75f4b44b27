// A connection to one service that stays open: TCPROS as in tcpros.h.
#pragma once

#include <chrono>
#include <cstddef>
#include <string>

#include "client/master.h"
#include "client/service_types.h"
#include "client/socket.h"
#include "client/tcpros.h"

namespace walker {

/// What a server sent: bytes of the connection, until its next call.
struct Answer {
  bool is_response = false;  ///< else a text that says why there is none
  const std::uint8_t* body = nullptr;
  std::size_t size = 0;
};

class ServiceConnection {
 public:
  /// Introduces itself to the server.
  /// @param name of the service, resolved
  /// @throws SocketError, Interrupted; std::runtime_error saying what is wrong with the answer
  ServiceConnection(const Endpoint& endpoint, const std::string& name, const ServiceType& type,
                    const Patience& patience);

  /// Sends a request with its length and waits for the answer.
  /// @throws SocketError, Interrupted, std::runtime_error; then the connection is of no use any
  /// more
  Answer call(const tcpros::Bytes& request, const Patience& patience);

 private:
  void receive_at_least(std::size_t size, const Patience& patience);
  tcpros::Fields receive_header(const Patience& patience);

  Socket socket_;
  std::size_t most_answer_bytes_;
  tcpros::Bytes input_;       // keeps its memory
  std::size_t received_ = 0;  // bytes at its beginning
};

}  // namespace walker
