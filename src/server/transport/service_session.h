// One client of a service port: its socket, and the progress of its header and requests.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>

#include "ros/throttle.h"
#include "server/transport/waking.h"
#include "wire/channel.h"
#include "wire/tcpros.h"

namespace walker {

struct OfferedService {
  std::string type;
  std::string md5sum;
  std::size_t max_request_bytes;
  /// Handles a request: appends length and serialised response, or returns an answer given later.
  /// @throws std::exception with the reason for no response; then nothing has been appended
  std::function<std::shared_ptr<PendingAnswer>(const std::uint8_t* request, std::size_t size,
                                               tcpros::Bytes& response)>
      call;
};

using OfferedServices = std::map<std::string, OfferedService>;  ///< by resolved name

struct SharedBySessions {
  OfferedServices services;
  const std::string* caller = nullptr;  ///< of the call in progress
  std::uint64_t moves = 0;  ///< reads and writes so far; orders the last activity of clients
  Throttle throttle;        ///< of log messages about clients, of which there may be many
};

/// Upper bound of a port's unfinished requests and unread answers together, and of one answer.
constexpr std::size_t kMaxHeldBytes = std::size_t{256} << 20U;

/// Logs a client's fault, unless the throttle suppresses it. Escapes text that the client sent.
void log_client(SharedBySessions& shared, const char* what, const std::string& why);

/// Speaks TCPROS (wire/tcpros.h) on a channel that does not block, and never waits.
///
/// While an answer is pending or not fully written, further requests stay in the system, so a
/// client that never reads costs the memory of one answer and delays no other client. Memory for a
/// request grows with the bytes that arrive, not with the announced length. A request that is too
/// long for its service is refused as soon as its length has arrived, and its bytes are discarded.
class ServiceSession {
 public:
  using Clock = std::chrono::steady_clock;

  /// @param shared outlives this
  ServiceSession(Channel channel, SharedBySessions& shared);
  ServiceSession(const ServiceSession&) = delete;
  ServiceSession& operator=(const ServiceSession&) = delete;

  bool is_shared() const { return channel_.is_shared(); }
  /// File descriptor to poll.
  int descriptor() const { return channel_.descriptor(); }
  /// Events to poll for, a bit mask of poll().
  short events() const;
  /// Whether a buffered request, a given answer, EOF or shared memory is ready, which poll() does
  /// not report.
  bool has_work() const {
    if (pending_) return pending_->is_given();
    return has_request() || is_at_end_ ||
           (has_output() ? channel_.has_room() : channel_.has_input());
  }
  /// Call this before blocking in poll(). @return false if the session has work by now
  bool may_wait() {
    if (pending_) return true;
    return has_output() ? channel_.await_room() : channel_.await_input();
  }
  /// Whether the header is late. With a header the client may idle forever, as with roscpp.
  bool is_overdue(Clock::time_point now) const { return service_ == nullptr && now >= due_; }

  enum class Outcome { waits, called, over };

  /// Reads, handles and writes as far as possible without blocking, and makes at most one call.
  /// @param happened events that poll() returned for its descriptor, or POLLIN to try to read from
  /// a
  ///                 socket
  /// @return `called` after a call that has been answered; `over` if the session is to be destroyed
  Outcome advance(short happened);

  /// Reads what has arrived of the next request, as poll() and `advance` would, with one system
  /// call fewer.
  /// @return whether `advance` has work
  bool read_ahead();

  /// Memory that it holds [bytes].
  std::size_t held() const { return input_.size() + output_.capacity() + pending_bytes_; }
  /// Whether it holds more memory than is granted to every client.
  bool holds_much() const { return held() > 2 * kKeptBytes; }
  /// `SharedBySessions::moves` at the client's last read or write.
  std::uint64_t moved_at() const { return moved_at_; }
  /// Frees its memory and sends the client the reason.
  /// @return false if that is not possible; then the session is to be destroyed
  bool give_way();

 private:
  /// Upper bound of the memory that each of its two buffers keeps between calls.
  static constexpr std::size_t kKeptBytes = std::size_t{64} << 10U;

  // These three return false if the connection is closed.
  bool receive();
  bool discard();
  bool send();
  bool is_gone_while_pending(short happened);
  void open(const std::uint8_t* header, std::size_t size);
  void answer(const std::uint8_t* request, std::size_t size);
  void take_frame(Outcome& outcome);
  void reject(const std::string& why);
  void store_failure(const std::string& why);
  void consume(std::size_t size);
  void make_room();
  bool has_length() const { return received_ - begin_ >= tcpros::kLengthBytes; }
  bool has_request() const;
  bool has_output() const { return sent_ < output_.size(); }
  std::size_t frame_size() const;
  std::size_t max_bytes() const;

  Channel channel_;
  SharedBySessions& shared_;
  const OfferedServices::value_type* service_ = nullptr;  // null until the header has arrived
  Clock::time_point due_;                                 // deadline of the header
  std::string caller_;                                    // escaped and truncated
  bool is_persistent_ = false;
  bool is_over_ = false;                    // ends once everything is sent
  bool is_at_end_ = false;                  // `read_ahead` has found the connection closed
  tcpros::Bytes input_;                     // keeps its capacity, like output_
  std::size_t begin_ = 0;                   // start of the next header or request
  std::size_t received_ = 0;                // end of the received bytes
  std::size_t discarded_ = 0;               // bytes of a refused request that are still to arrive
  std::shared_ptr<PendingAnswer> pending_;  // to the last request
  std::size_t pending_bytes_ = 0;           // of that request
  tcpros::Bytes output_;
  std::size_t sent_ = 0;
  std::uint64_t moved_at_ = 0;
};

}  // namespace walker
