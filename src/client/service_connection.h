// A connection to one service that stays open: TCPROS as in tcpros.h.
#pragma once

#include <cstddef>
#include <string>

#include "client/messages.h"
#include "client/service_types.h"
#include "wire/master.h"
#include "wire/socket.h"
#include "wire/tcpros.h"

namespace walker {

class ServiceConnection {
 public:
  /// Introduces itself to the server.
  /// @param name   of the service, resolved
  /// @param caller that the server shall know this client by
  /// @throws SocketError, Interrupted; std::runtime_error saying what is wrong with the answer
  ServiceConnection(const Endpoint& endpoint, const std::string& name, const ServiceType& type,
                    const std::string& caller, const Deadline& deadline);

  /// Sends a request with its length and waits for the answer.
  /// @param most_answer_bytes of which a longer one is not taken
  /// @return the serialised response: bytes of the connection, until its next call
  /// @throws RequestRefused with the server's words where it has none; SocketError, Interrupted,
  ///         std::runtime_error, and then the connection is of no use any more
  Reader call(const tcpros::Bytes& request, std::size_t most_answer_bytes,
              const Deadline& deadline);

 private:
  void receive_at_least(std::size_t size, const Deadline& deadline);
  tcpros::Fields receive_header(const Deadline& deadline);

  Socket socket_;
  tcpros::Bytes input_ = tcpros::Bytes(4096);  // keeps its memory
  std::size_t received_ = 0;                   // bytes at its beginning
};

}  // namespace walker
