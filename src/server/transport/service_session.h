// One client of a service port: its socket, and how far its header and its requests have come.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>

#include "client/tcpros.h"
#include "server/transport/pending_answer.h"

namespace walker {

/// A service as its clients know it.
struct OfferedService {
  std::string type;
  std::string md5sum;
  std::string request_type;
  std::string response_type;
  /// Takes a request and appends the serialised response with its length, or returns what the
  /// client has to wait for.
  /// @throws std::exception that says why there is none; then nothing has been appended
  std::function<std::shared_ptr<PendingAnswer>(const std::uint8_t* request, std::size_t size,
                                               tcpros::Bytes& response)>
      call;
};

using OfferedServices = std::map<std::string, OfferedService>;  ///< by resolved name

/// Speaks TCPROS (client/tcpros.h) on a non-blocking socket. It never waits: what has not come is
/// read when it comes, what the client does not take is written when it does. Until then its next
/// requests stay in the socket, so that a client that never reads holds one answer of memory and
/// nobody else; so they do while its answer is pending. Memory for a request grows with the bytes
/// that come, not with the length they claim.
class ServiceSession {
 public:
  /// @param descriptor of a connected socket; closed at the end
  ServiceSession(int descriptor, const OfferedServices& services);
  ServiceSession(const ServiceSession&) = delete;
  ServiceSession& operator=(const ServiceSession&) = delete;
  ~ServiceSession();

  int descriptor() const { return descriptor_; }
  /// For which it waits: a bit mask as poll takes it.
  short events() const;
  /// Whether a request or an answer lies here that no poll of its socket will tell of.
  bool has_work() const { return has_request() || (pending_ && pending_->is_given()); }

  enum class Outcome { waits, called, over };

  /// Goes on as far as it can without waiting, and makes one call at most.
  /// @param is_readable its socket may have something to be read, or have lost its client
  /// @return whether it has made a call, or is over: to be destroyed
  Outcome advance(bool is_readable);

 private:
  bool receive();
  bool send();
  void open(const std::uint8_t* header, std::size_t size);
  void answer(const std::uint8_t* request, std::size_t size);
  bool has_request() const;
  bool has_output() const { return sent_ < output_.size(); }
  std::size_t frame_size() const;
  void check_length() const;

  int descriptor_;
  const OfferedServices& services_;
  const OfferedService* service_ = nullptr;  // null until the header has come
  bool is_persistent_ = false;
  bool is_over_ = false;  // once everything is sent
  tcpros::Bytes input_;   // keeps its memory, as does the next
  std::size_t received_ = 0;
  std::shared_ptr<PendingAnswer> pending_;  // to the request before
  tcpros::Bytes output_;
  std::size_t sent_ = 0;
};

}  // namespace walker
