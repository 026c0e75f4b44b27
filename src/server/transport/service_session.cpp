#include "server/transport/service_session.h"

#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <exception>
#include <stdexcept>

#include <ros/console.h>
#include <ros/this_node.h>

namespace walker {
namespace {

constexpr std::size_t kFirstCapacity = 4096;

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

}  // namespace

ServiceSession::ServiceSession(int descriptor, const OfferedServices& services)
    : descriptor_(descriptor), services_(services), input_(kFirstCapacity) {}

ServiceSession::~ServiceSession() { close(descriptor_); }

short ServiceSession::events() const {
  if (pending_) return POLLRDHUP;
  return has_output() ? POLLOUT : POLLIN;
}

/// Of the header or request at the input's beginning, with its length, once that has come.
std::size_t ServiceSession::frame_size() const {
  return tcpros::kLengthBytes + tcpros::load_length(input_.data());
}

/// @throws std::runtime_error for a length that nobody means
void ServiceSession::check_length() const {
  const std::size_t most = service_ ? tcpros::kMostMessageBytes : tcpros::kMostHeaderBytes;
  if (received_ < tcpros::kLengthBytes || frame_size() - tcpros::kLengthBytes <= most) return;
  throw std::runtime_error("it announces " + std::to_string(frame_size()) + " bytes; at most " +
                           std::to_string(most) + " are taken");
}

bool ServiceSession::has_request() const {
  return !pending_ && !has_output() && received_ >= tcpros::kLengthBytes &&
         received_ >= frame_size();
}

ServiceSession::Outcome ServiceSession::advance(bool is_readable) {
  Outcome outcome = Outcome::waits;
  if (pending_) {
    if (!pending_->is_given()) return is_readable ? Outcome::over : Outcome::waits;
    output_ = pending_->take();
    pending_.reset();
  }
  try {
    if (!has_output() && is_readable && !receive()) return Outcome::over;
    check_length();
    if (has_request()) {
      const std::size_t size = frame_size();
      const std::uint8_t* const begin = input_.data() + tcpros::kLengthBytes;
      sent_ = 0;
      output_.clear();
      if (service_) {
        answer(begin, size - tcpros::kLengthBytes);
        if (!pending_) outcome = Outcome::called;
      } else {
        open(begin, size - tcpros::kLengthBytes);
      }
      std::copy(input_.data() + size, input_.data() + received_, input_.data());
      received_ -= size;
    }
  } catch (const std::exception& error) {
    ROS_WARN_STREAM("A client of the services is cut off: " << error.what());
    return Outcome::over;
  }
  const bool is_over = !send() || (is_over_ && !pending_ && !has_output());
  return is_over ? Outcome::over : outcome;
}

/// @return false when the client has gone
bool ServiceSession::receive() {
  if (received_ == input_.size()) input_.resize(2 * input_.size());
  const ssize_t size = recv(descriptor_, &input_[received_], input_.size() - received_, 0);
  if (size == 0) return false;
  if (size < 0) return errno == EAGAIN || errno == EINTR;
  received_ += static_cast<std::size_t>(size);
  return true;
}

/// @return false when the client has gone
bool ServiceSession::send() {
  while (has_output()) {
    const ssize_t size = ::send(descriptor_, &output_[sent_], output_.size() - sent_, MSG_NOSIGNAL);
    if (size < 0) return errno == EAGAIN || errno == EINTR;
    sent_ += static_cast<std::size_t>(size);
  }
  return true;
}

void ServiceSession::open(const std::uint8_t* header, std::size_t size) {
  try {
    const tcpros::Fields fields = tcpros::parse_header(header, size);
    const std::string& name = required(fields, "service");
    const std::string& md5sum = required(fields, "md5sum");
    const std::string& caller = required(fields, "callerid");
    const auto service = services_.find(name);
    if (service == services_.end()) {
      throw std::runtime_error(caller + " asks for the service " + name +
                               ", which this node does not have");
    }
    if (md5sum != "*" && md5sum != service->second.md5sum) {
      throw std::runtime_error(caller + " expects " + name + " to have the MD5 " + md5sum +
                               "; it is " + service->second.md5sum + " (" + service->second.type +
                               ")");
    }
    service_ = &service->second;
    is_persistent_ = is_set(fields, "persistent");
  } catch (const std::exception& error) {
    ROS_WARN_STREAM("A client of the services is refused: " << error.what());
    tcpros::append_header({{"error", error.what()}}, output_);
    is_over_ = true;
    return;
  }
  tcpros::append_header({{"callerid", ros::this_node::getName()},
                         {"md5sum", service_->md5sum},
                         {"request_type", service_->request_type},
                         {"response_type", service_->response_type},
                         {"type", service_->type}},
                        output_);
}

void ServiceSession::answer(const std::uint8_t* request, std::size_t size) {
  is_over_ = !is_persistent_;
  try {
    output_.push_back(1);
    pending_ = service_->call(request, size, output_);
    if (pending_) output_.clear();
  } catch (const std::exception& error) {
    const std::string reason = error.what();
    output_.assign(1 + tcpros::kLengthBytes, 0);
    tcpros::store_length(reason.size(), &output_[1]);
    output_.insert(output_.end(), reason.begin(), reason.end());
  }
}

}  // namespace walker
