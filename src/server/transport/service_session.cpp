#include "server/transport/service_session.h"

#include <poll.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <exception>
#include <stdexcept>
#include <utility>

#include <ros/console.h>
#include <ros/this_node.h>

#include "base/printable_text.h"

namespace walker {
namespace {

constexpr std::size_t kFirstCapacity = 4096;
// A TCPROS client sends its header as soon as it is connected.
constexpr std::chrono::seconds kUntilHeader{10};

/// @throws std::runtime_error naming what is missing
const std::string& required(const tcpros::Fields& fields, const char* name) {
  const auto field = fields.find(name);
  if (field == fields.end()) {
    throw std::runtime_error(std::string("connection header: ") + name + " is missing");
  }
  return field->second;
}

bool is_set(const tcpros::Fields& fields, const char* name) {
  const auto field = fields.find(name);
  return field != fields.end() && (field->second == "1" || field->second == "true");
}

/// Escapes and truncates a client's text for an error message.
std::string quoted(const std::string& text) { return printable(text, kMaxQuotedBytes); }

bool is_retryable_errno() { return errno == EAGAIN || errno == EINTR; }

void free_memory(tcpros::Bytes& bytes) { tcpros::Bytes().swap(bytes); }

}  // namespace

void log_client(SharedBySessions& shared, const char* what, const std::string& why) {
  if (!shared.throttle.passes()) return;
  ROS_WARN_STREAM("A client of the services " << what << ": " << printable(why)
                                              << shared.throttle.left_out());
}

ServiceSession::ServiceSession(Channel channel, SharedBySessions& shared)
    : channel_(std::move(channel)),
      shared_(shared),
      due_(Clock::now() + kUntilHeader),
      input_(kFirstCapacity) {}

short ServiceSession::events() const {
  // After EOF, POLLRDHUP would fire on every poll; an RST is reported regardless.
  if (pending_) return sent_ == 0 ? POLLRDHUP : 0;
  return has_output() && !channel_.is_shared() ? POLLOUT : POLLIN;
}

/// Size of the next header or request, including its length field. Requires `has_length()`.
std::size_t ServiceSession::frame_size() const {
  return tcpros::kLengthBytes + tcpros::load_length(&input_[begin_]);
}

/// Upper bound of the next header or request, without its length field.
std::size_t ServiceSession::max_bytes() const {
  return service_ != nullptr ? service_->second.max_request_bytes : tcpros::kMaxHeaderBytes;
}

bool ServiceSession::has_request() const {
  if (pending_ || has_output() || !has_length()) return false;
  const std::size_t size = frame_size();
  return received_ - begin_ >= size || size - tcpros::kLengthBytes > max_bytes();
}

bool ServiceSession::read_ahead() {
  const bool has_room = received_ < input_.size();  // more memory would have to be accounted for
  if (pending_ || has_output() || has_request() || !has_room) return has_work();
  is_at_end_ = !receive();
  return has_work();
}

ServiceSession::Outcome ServiceSession::advance(short happened) {
  if (is_at_end_) return Outcome::over;
  if (happened != 0) channel_.take_wakeup();
  if (pending_) {
    if (is_gone_while_pending(happened)) return Outcome::over;
    if (!pending_->is_given()) return Outcome::waits;
    output_ = pending_->take();
    pending_.reset();
    pending_bytes_ = 0;
  }
  Outcome outcome = Outcome::waits;
  try {
    // Answers buffered requests before reading more: a client may send requests and then EOF.
    const bool may_read = channel_.has_input() || (happened & ~POLLOUT) != 0;
    if (!has_output() && !has_request() && may_read && !receive()) {
      return Outcome::over;
    }
    if (has_request()) take_frame(outcome);
  } catch (const std::exception& error) {  // out of memory
    log_client(shared_, "is cut off", error.what());
    return Outcome::over;
  }
  const bool is_over = !send() || (is_over_ && !pending_ && !has_output() && discarded_ == 0);
  return is_over ? Outcome::over : outcome;
}

void ServiceSession::take_frame(Outcome& outcome) {
  const std::size_t size = frame_size() - tcpros::kLengthBytes;
  if (size > max_bytes()) {
    const std::string what = service_ != nullptr ? "service " + service_->first + ": a request"
                                                 : "connection header: a header";
    reject(what + " of " + std::to_string(size) + " bytes; at most " + std::to_string(max_bytes()) +
           " are accepted");
    return;
  }
  sent_ = 0;
  output_.clear();
  const std::uint8_t* const begin = &input_[begin_] + tcpros::kLengthBytes;
  if (service_ != nullptr) {
    answer(begin, size);
    if (pending_) {
      pending_bytes_ = size;
    } else {
      outcome = Outcome::called;
    }
  } else {
    open(begin, size);
  }
  consume(tcpros::kLengthBytes + size);
}

/// Rejects the next header or request: logs the reason and sends it to the client. After a rejected
/// header the session ends; the remaining bytes of a rejected request are discarded.
void ServiceSession::reject(const std::string& why) {
  log_client(shared_, "is refused", why);
  sent_ = 0;
  output_.clear();
  if (service_ == nullptr) {
    tcpros::append_header({{"error", why}}, output_);
    is_over_ = true;
    return;
  }
  is_over_ = !is_persistent_;
  store_failure(why);
  consume(frame_size());
}

/// Replaces the output by TCPROS' answer to a failed call.
void ServiceSession::store_failure(const std::string& why) {
  output_.assign(1 + tcpros::kLengthBytes, 0);
  tcpros::store_length(why.size(), &output_[1]);
  output_.insert(output_.end(), why.begin(), why.end());
}

/// Drops the received part of a frame of this size; the rest will be discarded as it arrives.
void ServiceSession::consume(std::size_t size) {
  const std::size_t here = std::min(size, received_ - begin_);
  begin_ += here;
  discarded_ = size - here;
  if (begin_ < received_) return;
  begin_ = received_ = 0;
  if (input_.size() > kKeptBytes) {
    free_memory(input_);
    input_.resize(kFirstCapacity);
  }
}

/// Makes room in input_ for at least one more byte.
void ServiceSession::make_room() {
  if (received_ < input_.size()) return;
  if (begin_ > 0) {  // moves less than a frame, once per full buffer
    std::copy(input_.data() + begin_, input_.data() + received_, input_.data());
    received_ -= begin_;
    begin_ = 0;
    return;
  }
  const std::size_t double_size = 2 * input_.size();
  input_.resize(has_length() ? std::min(double_size, frame_size()) : double_size);
}

bool ServiceSession::receive() {
  if (discarded_ > 0) return discard();
  make_room();
  const ssize_t size = channel_.read(&input_[received_], input_.size() - received_);
  if (size == 0) return false;
  if (size < 0) return is_retryable_errno();
  received_ += static_cast<std::size_t>(size);
  moved_at_ = ++shared_.moves;
  return true;
}

bool ServiceSession::discard() {
  std::array<std::uint8_t, kKeptBytes> nowhere;  // NOLINT(cppcoreguidelines-pro-type-member-init)
  const ssize_t size = channel_.read(nowhere.data(), std::min(discarded_, nowhere.size()));
  if (size == 0) return false;
  if (size < 0) return is_retryable_errno();
  discarded_ -= static_cast<std::size_t>(size);
  return true;
}

bool ServiceSession::send() {
  if (pending_) return true;  // keeps sent_, for its first byte may have been sent
  while (has_output()) {
    const ssize_t size = channel_.write(&output_[sent_], output_.size() - sent_);
    if (size < 0) return is_retryable_errno();
    sent_ += static_cast<std::size_t>(size);
    moved_at_ = ++shared_.moves;
  }
  if (output_.capacity() > kKeptBytes) {
    free_memory(output_);
    sent_ = 0;
  }
  return true;
}

/// EOF of a socket alone does not show that the client has disconnected: it may have shut down only
/// its sending side and wait for the answer. So the session sends the first byte of the answer
/// early; if the client has closed its socket, its system replies with RST.
bool ServiceSession::is_gone_while_pending(short happened) {
  if ((happened & (POLLERR | POLLHUP)) != 0) return true;
  if ((happened & POLLRDHUP) == 0 || sent_ > 0) return false;
  const ssize_t size = channel_.write(&tcpros::kResponseFollows, 1);
  if (size < 0) return !is_retryable_errno();
  sent_ = 1;
  return false;
}

bool ServiceSession::give_way() {
  const std::string why = "its unfinished requests and unread answers hold " +
                          std::to_string(held()) +
                          " bytes, and of such clients it has been idle longest; all clients "
                          "together may hold " +
                          std::to_string(kMaxHeldBytes);
  if (pending_ || has_output() || !has_length() || service_ == nullptr) {
    log_client(shared_, "is cut off", why);
    return false;
  }
  reject("service " + service_->first + ": " + why);
  return send();
}

void ServiceSession::open(const std::uint8_t* header, std::size_t size) {
  try {
    const tcpros::Fields fields = tcpros::parse_header(header, size);
    const std::string& name = required(fields, "service");
    const std::string& md5sum = required(fields, "md5sum");
    const std::string& caller = required(fields, "callerid");
    const auto service = shared_.services.find(name);
    if (service == shared_.services.end()) {
      throw std::runtime_error(quoted(caller) + " asks for the service " + quoted(name) +
                               ", which this node does not have");
    }
    if (md5sum != "*" && md5sum != service->second.md5sum) {
      throw std::runtime_error(quoted(caller) + " expects " + name + " to have the MD5 " +
                               quoted(md5sum) + "; it is " + service->second.md5sum + " (" +
                               service->second.type + ")");
    }
    service_ = &*service;
    caller_ = quoted(caller);
    is_persistent_ = is_set(fields, "persistent");
  } catch (const std::exception& error) {
    reject(printable(error.what()));
    return;
  }
  const OfferedService& service = service_->second;
  tcpros::append_header({{"callerid", ros::this_node::getName()},
                         {"md5sum", service.md5sum},
                         {"request_type", service.type + "Request"},
                         {"response_type", service.type + "Response"},
                         {"type", service.type}},
                        output_);
}

void ServiceSession::answer(const std::uint8_t* request, std::size_t size) {
  is_over_ = !is_persistent_;
  shared_.caller = &caller_;
  try {
    output_.push_back(tcpros::kResponseFollows);
    pending_ = service_->second.call(request, size, output_);
    if (pending_) {
      output_.clear();
    } else if (output_.size() > kMaxHeldBytes) {
      const std::string why = "service " + service_->first + ": an answer of " +
                              std::to_string(output_.size()) + " bytes; at most " +
                              std::to_string(kMaxHeldBytes) + " can be sent";
      log_client(shared_, "gets no answer", why);
      free_memory(output_);
      store_failure(why);
    }
  } catch (const std::exception& error) {
    store_failure(printable(error.what()));
  }
}

}  // namespace walker
