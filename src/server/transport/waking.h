// What other threads give the serving thread, and how they wake it: callbacks, and answers to
// service calls.
#pragma once

#include <sys/eventfd.h>
#include <unistd.h>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>

#include <ros/callback_queue.h>
#include <ros/serialization.h>

#include "base/posix.h"
#include "wire/tcpros.h"

namespace walker {

/// A file descriptor that any thread can make readable.
class EventDescriptor {
 public:
  /// @throws std::system_error if no file descriptor is left
  EventDescriptor() : descriptor_(checked(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC), "eventfd")) {}
  EventDescriptor(const EventDescriptor&) = delete;
  EventDescriptor& operator=(const EventDescriptor&) = delete;
  ~EventDescriptor() { close(descriptor_); }

  int get() const { return descriptor_; }

  void signal() { eventfd_write(descriptor_, 1); }

  /// Makes it unreadable until the next signal.
  void clear() {
    eventfd_t ignored = 0;
    eventfd_read(descriptor_, &ignored);
  }

 private:
  int descriptor_;
};

/// A pollable callback queue: ros::CallbackQueue's own wait cannot be combined with poll().
class WakingQueue : public ros::CallbackQueue {
 public:
  /// Readable if callbacks may be waiting.
  int descriptor() const { return event_.get(); }

  /// Called in any thread, mostly roscpp's.
  void addCallback(const ros::CallbackInterfacePtr& callback, std::uint64_t owner) override {
    CallbackQueue::addCallback(callback, owner);
    event_.signal();
  }

  void call() {
    event_.clear();  // before the calls: callbacks that arrive during them signal again
    callAvailable();
  }

 private:
  EventDescriptor event_;
};

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
