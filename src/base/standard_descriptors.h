// Guards against a process that was started without stdin, stdout or stderr.
#pragma once

#include <fcntl.h>
#include <unistd.h>

namespace walker {

/// Opens /dev/null on each of the descriptors 0, 1 and 2 that is closed. Otherwise the next file or
/// socket gets its number, and receives what libraries print. A node's main() calls it first.
inline void open_standard_descriptors() {
  int descriptor = 0;
  do {
    descriptor = open("/dev/null", O_RDWR);  // takes the lowest free descriptor
  } while (descriptor >= 0 && descriptor <= STDERR_FILENO);
  if (descriptor >= 0) close(descriptor);
}

}  // namespace walker
