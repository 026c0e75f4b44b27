// Pollable file descriptors for events from other threads.
#pragma once

#include <sys/eventfd.h>
#include <unistd.h>

#include <cstdint>

#include <ros/callback_queue.h>

#include "base/posix.h"

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

}  // namespace walker
