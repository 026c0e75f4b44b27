// One client of a service port: its socket, and how far its header and its requests have come.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>

#include "ros/throttle.h"
#include "server/transport/pending_answer.h"
#include "wire/tcpros.h"

namespace walker {

/// A service as its clients know it.
struct OfferedService {
  std::string type;
  std::string md5sum;
  std::string request_type;
  std::string response_type;
  std::size_t most_request_bytes;
  /// Takes a request and appends the serialised response with its length, or returns what the
  /// client has to wait for.
  /// @throws std::exception that says why there is none; then nothing has been appended
  std::function<std::shared_ptr<PendingAnswer>(const std::uint8_t* request, std::size_t size,
                                               tcpros::Bytes& response)>
      call;
};

using OfferedServices = std::map<std::string, OfferedService>;  ///< by resolved name

/// What the sessions of a port have in common.
struct SharedBySessions {
  OfferedServices services;
  const std::string* caller = nullptr;  ///< of the call that is being made
  std::uint64_t moves = 0;  ///< reads and writes so far: the order of what clients last did
  Throttle throttle;        ///< of what is logged of clients, for there may be thousands
};

/// How much all sessions of a port may hold of unfinished requests and of answers that have not
/// been read; an answer longer than this is not given.
constexpr std::size_t kMaxHeldBytes = std::size_t{256} << 20U;

/// Logs what a client did wrong, where the throttle lets it. What the client itself has sent is
/// made printable.
void log_client(SharedBySessions& shared, const char* what, const std::string& why);

/// Speaks TCPROS (wire/tcpros.h) on a non-blocking socket. It never waits: what has not come is
/// read when it comes, what the client does not take is written when it does. Until then its next
/// requests stay in the socket, so that a client that never reads holds one answer of memory and
/// nobody else; so they do while its answer is pending. Memory for a request grows with the bytes
/// that come, not with the length they claim; one that is too long for its service is refused as
/// soon as its length is there, and thrown away as it comes.
class ServiceSession {
 public:
  using Clock = std::chrono::steady_clock;

  /// @param descriptor of a connected socket; closed at the end
  /// @param shared     outlives this
  ServiceSession(int descriptor, SharedBySessions& shared);
  ServiceSession(const ServiceSession&) = delete;
  ServiceSession& operator=(const ServiceSession&) = delete;
  ~ServiceSession();

  int descriptor() const { return descriptor_; }
  /// For which it waits: a bit mask as poll takes it.
  short events() const;
  /// Whether a request or an answer lies here that no poll of its socket will tell of.
  bool has_work() const { return has_request() || (pending_ && pending_->is_given()); }
  /// Without a header it may stay for so long and no longer; with one for ever, as roscpp's
  /// clients.
  bool is_overdue(Clock::time_point now) const { return service_ == nullptr && now >= due_; }

  enum class Outcome { waits, called, over };

  /// Goes on as far as it can without waiting, and makes one call at most.
  /// @param happened what poll says of its socket
  /// @return whether it has made a call, or is over: to be destroyed
  Outcome advance(short happened);

  /// Bytes of memory.
  std::size_t held() const { return input_.size() + output_.capacity() + pending_bytes_; }
  /// Whether it holds more than every client may.
  bool holds_much() const { return held() > 2 * kKeptBytes; }
  /// When the client last took or sent something, as the count of moves.
  std::uint64_t moved_at() const { return moved_at_; }
  /// Gives back what it holds, and tells the client why.
  /// @return false where that is not possible: to be destroyed
  bool give_way();

 private:
  /// Of each of its two buffers, between calls.
  static constexpr std::size_t kKeptBytes = std::size_t{64} << 10U;

  bool receive();
  bool discard();
  bool send();
  bool is_gone_while_pending(short happened);
  void take_pending();
  void open(const std::uint8_t* header, std::size_t size);
  void answer(const std::uint8_t* request, std::size_t size);
  void take_frame(Outcome& outcome);
  void refuse(const std::string& why);
  void refuse_long_answer();
  void consume(std::size_t size);
  void make_room();
  bool has_length() const { return received_ - begin_ >= tcpros::kLengthBytes; }
  bool has_request() const;
  bool has_output() const { return sent_ < output_.size(); }
  std::size_t frame_size() const;
  std::size_t most_bytes() const;

  int descriptor_;
  SharedBySessions& shared_;
  const OfferedServices::value_type* service_ = nullptr;  // null until the header has come
  Clock::time_point due_;                                 // of the header
  std::string caller_;                                    // printable, and cut where it is long
  bool is_persistent_ = false;
  bool is_over_ = false;       // once everything is sent
  tcpros::Bytes input_;        // keeps its memory, as does the next
  std::size_t begin_ = 0;      // of the next header or request
  std::size_t received_ = 0;   // end of what has come
  std::size_t discarded_ = 0;  // bytes that are still to come of a request that is refused
  std::shared_ptr<PendingAnswer> pending_;  // to the request before
  std::size_t pending_bytes_ = 0;           // of that request
  tcpros::Bytes output_;
  std::size_t sent_ = 0;
  std::uint64_t moved_at_ = 0;
};

}  // namespace walker
