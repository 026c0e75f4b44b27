#include "server/waking_queue.h"

#include <sys/eventfd.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

namespace walker {

WakingQueue::WakingQueue() : descriptor_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
  if (descriptor_ < 0) throw std::system_error(errno, std::generic_category(), "eventfd");
}

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
