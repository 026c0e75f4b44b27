// Lets a host interrupt long operations: compiling a model, creating many environments.
#pragma once

#include <poll.h>

#include "walker_sim/client.h"  // Interrupted
#include "walker_sim/export.h"

namespace walker {

/// A replacement for ::poll. @throws Interrupted if a signal has arrived that ends the operation
using Poll = int (*)(pollfd* files, nfds_t num_files, int timeout);

/// Sets the process-wide function that long operations call in the caller's thread. The default is
/// ::poll: a signal either ends the process or has no effect on the operation.
WALKER_SIM_EXPORT void set_poll(Poll poll);

/// Polls one file with the host's `Poll`. The timeout is in ms, the result as ::poll's.
/// @throws Interrupted
int poll_interruptibly(pollfd& file, int timeout);

/// @throws Interrupted if a signal has arrived that ends the operation
void check_interruption();

}  // namespace walker
