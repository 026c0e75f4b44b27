// roscpp's callbacks, for a thread that waits on sockets too.
#pragma once

#include <cstdint>

#include <ros/callback_queue.h>

namespace walker {

/// A queue that a poll can wait on: for who waits inside ros::CallbackQueue hears nothing else.
class WakingQueue : public ros::CallbackQueue {
 public:
  /// @throws std::system_error when the system has no descriptor left
  WakingQueue();
  WakingQueue(const WakingQueue&) = delete;
  WakingQueue& operator=(const WakingQueue&) = delete;
  ~WakingQueue() override;

  /// Readable while callbacks may wait to be called.
  int descriptor() const { return descriptor_; }

  /// From any thread, roscpp's above all.
  void addCallback(const ros::CallbackInterfacePtr& callback, std::uint64_t owner) override;

  /// Calls what has come so far, in this thread.
  void call();

 private:
  int descriptor_;
};

}  // namespace walker
