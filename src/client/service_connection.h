// Persistent TCPROS connection to one service.
#pragma once

#include <chrono>
#include <cstddef>
#include <string>

#include "base/spin_wait.h"
#include "client/messages.h"
#include "wire/master.h"
#include "wire/socket.h"
#include "wire/tcpros.h"

namespace walker {

class ServiceConnection {
 public:
  /// Connects and exchanges headers.
  /// @param name   resolved name of the service
  /// @param caller name by which the server identifies this client
  /// @param spin   longest time to poll for an answer before blocking
  /// @throws SocketError, Interrupted; std::runtime_error if the server's header is malformed, an
  ///         error, or of another version of the service
  ServiceConnection(const Endpoint& endpoint, const std::string& name, const ServiceType& type,
                    const std::string& caller, std::chrono::microseconds spin,
                    const Deadline& deadline);

  /// Sends a request and blocks until its answer.
  /// @param request begins with its length
  /// @param max_answer_bytes upper bound of the answer
  /// @return the serialised response, valid until the next call
  /// @throws RequestRefused with the server's reason; SocketError, Interrupted, std::runtime_error,
  ///         after which the connection is unusable
  Reader call(const tcpros::Bytes& request, std::size_t max_answer_bytes, const Deadline& deadline);

 private:
  void receive_at_least(std::size_t size, const Deadline& deadline);
  tcpros::Fields receive_header(const Deadline& deadline);

  Socket socket_;
  SpinWait<> spin_;
  tcpros::Bytes input_ = tcpros::Bytes(4096);  // keeps its memory between calls
  std::size_t received_ = 0;                   // valid bytes of `input_`
};

}  // namespace walker
