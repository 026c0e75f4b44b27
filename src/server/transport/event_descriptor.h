// What one thread tells another that polls descriptors.
#pragma once

#include <sys/eventfd.h>
#include <unistd.h>

#include "core/checked.h"

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

}  // namespace walker
