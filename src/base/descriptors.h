// Keeps file descriptors out of the range of the standard ones.
#pragma once

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>

namespace walker {

/// Moves a file descriptor above stderr's. If the process has closed its standard descriptors, new
/// files get their numbers, and printed text would go there.
/// @param descriptor a negative value is returned unchanged
/// @return the new descriptor, close-on-exec; -1 with errno on failure
inline int above_standard(int descriptor) {
  if (descriptor < 0 || descriptor > STDERR_FILENO) return descriptor;
  const int moved = fcntl(descriptor, F_DUPFD_CLOEXEC, STDERR_FILENO + 1);
  const int error = errno;
  close(descriptor);
  errno = error;
  return moved;
}

}  // namespace walker
