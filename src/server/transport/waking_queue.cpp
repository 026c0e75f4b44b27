#include "server/transport/waking_queue.h"

namespace walker {

void WakingQueue::addCallback(const ros::CallbackInterfacePtr& callback, std::uint64_t owner) {
  CallbackQueue::addCallback(callback, owner);
  event_.signal();
}

void WakingQueue::call() {
  event_.clear();  // before the calls: what comes during them makes the descriptor readable again
  callAvailable();
}

}  // namespace walker
