// File descriptors beside a host's standard ones.
#pragma once

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>

namespace walker {

/// Moves a descriptor above the standard ones. If a process has closed these, new files get their
/// numbers, and whatever prints would write to them.
/// @param descriptor negative: passed through
/// @return the descriptor, close-on-exec; -1 with errno
inline int above_standard(int descriptor) {
  if (descriptor < 0 || descriptor > STDERR_FILENO) return descriptor;
  const int moved = fcntl(descriptor, F_DUPFD_CLOEXEC, STDERR_FILENO + 1);
  const int error = errno;
  close(descriptor);
  errno = error;
  return moved;
}

}  // namespace walker
