// Answers to service calls that are given later, possibly by another thread.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>

#include <ros/serialization.h>

#include "server/transport/waking.h"
#include "wire/tcpros.h"

namespace walker {

/// Appends the length of a response and its serialised bytes.
template <typename Response>
void append_response(const Response& response, tcpros::Bytes& bytes) {
  const std::uint32_t size = ros::serialization::serializationLength(response);
  const std::size_t begin = bytes.size();
  bytes.resize(begin + tcpros::kLengthBytes + size);
  tcpros::store_length(size, &bytes[begin]);
  ros::serialization::OStream stream(&bytes[begin] + tcpros::kLengthBytes, size);
  ros::serialization::serialize(stream, response);
}

/// The answer that a client waits for. Its session owns it until the answer is taken.
class PendingAnswer {
 public:
  /// @param event wakes the serving thread
  explicit PendingAnswer(std::shared_ptr<EventDescriptor> event) : event_(std::move(event)) {}

  /// Stores the answer and wakes the serving thread. Called once, from any thread.
  /// @param bytes as the client receives them; they begin with kResponseFollows
  void give(tcpros::Bytes bytes) {
    bytes_ = std::move(bytes);
    is_given_.store(true, std::memory_order_release);
    event_->signal();
  }

  bool is_given() const { return is_given_.load(std::memory_order_acquire); }
  /// Requires `is_given()`.
  tcpros::Bytes take() { return std::move(bytes_); }

 private:
  std::shared_ptr<EventDescriptor> event_;
  tcpros::Bytes bytes_;
  std::atomic<bool> is_given_{false};
};

/// Sends the response to one call, once, from any thread; dropped if the client has disconnected.
template <typename Response>
class Reply {
 public:
  explicit Reply(std::weak_ptr<PendingAnswer> pending) : pending_(std::move(pending)) {}

  /// Whether the client is still connected, as far as the server knows.
  bool is_awaited() const { return !pending_.expired(); }

  void operator()(const Response& response) const {
    tcpros::Bytes bytes{tcpros::kResponseFollows};
    append_response(response, bytes);
    if (const std::shared_ptr<PendingAnswer> pending = pending_.lock()) {
      pending->give(std::move(bytes));
    }
  }

 private:
  std::weak_ptr<PendingAnswer> pending_;
};

}  // namespace walker
