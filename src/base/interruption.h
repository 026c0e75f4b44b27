// How a host ends what takes long: a model's compilation, the making of many environments.
#pragma once

#include <poll.h>

#include "walker_sim/client.h"  // Interrupted
#include "walker_sim/export.h"

namespace walker {

/// Waits as ::poll does. @throws Interrupted if a signal has come that ends what is under way
using Poll = int (*)(pollfd* files, nfds_t num_files, int timeout);

/// Sets what `make` and its like wait by, in the calling thread, from now on in this process. Until
/// then it is ::poll: a signal either ends the process or changes nothing.
WALKER_SIM_EXPORT void set_poll(Poll poll);

/// Waits for one file by the host's `Poll`.
/// @param timeout [ms]
/// @return as ::poll
/// @throws Interrupted
int poll_interruptibly(pollfd& file, int timeout);

/// @throws Interrupted if a signal has come that ends what is under way
void check_interruption();

}  // namespace walker
