#include "server/waking_queue.h"

#include <sys/eventfd.h>
#include <unistd.h>

#include "core/checked.h"

namespace walker {

WakingQueue::WakingQueue()
    : descriptor_(checked(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC), "eventfd")) {}

WakingQueue::~WakingQueue() { close(descriptor_); }

void WakingQueue::addCallback(const ros::CallbackInterfacePtr& callback, std::uint64_t owner) {
  CallbackQueue::addCallback(callback, owner);
  eventfd_write(descriptor_, 1);
}

void WakingQueue::call() {
  // Before the calls: what comes during them makes the descriptor readable again.
  eventfd_t ignored = 0;
  eventfd_read(descriptor_, &ignored);
  callAvailable();
}

}  // namespace walker
