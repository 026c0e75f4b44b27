// How a thread that polls descriptors hears of others.
#pragma once

#include <sys/eventfd.h>
#include <unistd.h>

#include <cstdint>

#include <ros/callback_queue.h>

#include "base/checked.h"

namespace walker {

/// A descriptor that any thread makes readable.
class EventDescriptor {
 public:
  /// @throws std::system_error when the system has no descriptor left
  EventDescriptor() : descriptor_(checked(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC), "eventfd")) {}
  EventDescriptor(const EventDescriptor&) = delete;
  EventDescriptor& operator=(const EventDescriptor&) = delete;
  ~EventDescriptor() { close(descriptor_); }

  /// To be polled.
  int get() const { return descriptor_; }

  void signal() { eventfd_write(descriptor_, 1); }

  /// Not readable any more until the next signal.
  void clear() {
    eventfd_t ignored = 0;
    eventfd_read(descriptor_, &ignored);
  }

 private:
  int descriptor_;
};

/// A queue that a poll can wait on: for who waits inside ros::CallbackQueue hears nothing else.
class WakingQueue : public ros::CallbackQueue {
 public:
  /// Readable while callbacks may wait to be called.
  int descriptor() const { return event_.get(); }

  /// From any thread, roscpp's above all.
  void addCallback(const ros::CallbackInterfacePtr& callback, std::uint64_t owner) override {
    CallbackQueue::addCallback(callback, owner);
    event_.signal();
  }

  /// Calls what has come so far, in this thread.
  void call() {
    event_.clear();  // before the calls: what comes during them makes the descriptor readable again
    callAvailable();
  }

 private:
  EventDescriptor event_;
};

}  // namespace walker
