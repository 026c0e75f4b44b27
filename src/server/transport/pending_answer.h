// Answers to service calls that take their time: another thread gives them.
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

/// Appends a serialised response with its length.
template <typename Response>
void append_response(const Response& response, tcpros::Bytes& bytes) {
  const std::uint32_t size = ros::serialization::serializationLength(response);
  const std::size_t begin = bytes.size();
  bytes.resize(begin + tcpros::kLengthBytes + size);
  tcpros::store_length(size, &bytes[begin]);
  ros::serialization::OStream stream(&bytes[begin] + tcpros::kLengthBytes, size);
  ros::serialization::serialize(stream, response);
}

/// What a client waits for. Lives as long as its connection.
class PendingAnswer {
 public:
  /// @param event tells the thread that serves
  explicit PendingAnswer(std::shared_ptr<EventDescriptor> event) : event_(std::move(event)) {}

  /// Once, from any thread.
  /// @param bytes as they go to the client; they begin with kResponseFollows
  void give(tcpros::Bytes bytes) {
    bytes_ = std::move(bytes);
    is_given_.store(true, std::memory_order_release);
    event_->signal();
  }

  bool is_given() const { return is_given_.load(std::memory_order_acquire); }
  /// Once it is given.
  tcpros::Bytes take() { return std::move(bytes_); }

 private:
  std::shared_ptr<EventDescriptor> event_;
  tcpros::Bytes bytes_;
  std::atomic<bool> is_given_{false};
};

/// Takes the response to one call, from any thread and at any time: after the client has gone it
/// goes nowhere.
template <typename Response>
class Reply {
 public:
  explicit Reply(std::weak_ptr<PendingAnswer> pending) : pending_(std::move(pending)) {}

  /// Whether the client is still there, as far as anybody knows.
  bool is_awaited() const { return !pending_.expired(); }

  /// To be called once.
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
