// Standard input, output and error of a process that was started without some of them.
#pragma once

#include <fcntl.h>
#include <unistd.h>

namespace walker {

/// Opens /dev/null as each of the descriptors 0, 1 and 2 that is closed. Else the next file or
/// socket gets its number, and what a library prints lands in there. First thing of a main of ours.
inline void open_standard_descriptors() {
  int descriptor = 0;
  do {
    descriptor = open("/dev/null", O_RDWR);  // the lowest closed one
  } while (descriptor >= 0 && descriptor <= STDERR_FILENO);
  if (descriptor >= 0) close(descriptor);
}

}  // namespace walker
