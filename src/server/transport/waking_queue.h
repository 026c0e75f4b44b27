// roscpp's callbacks, for a thread that waits on sockets too.
#pragma once

#include <cstdint>

#include <ros/callback_queue.h>

#include "server/transport/event_descriptor.h"

namespace walker {

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
