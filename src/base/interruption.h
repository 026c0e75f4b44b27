// Lets a host interrupt long operations: compiling a model, creating or stepping many environments.
#pragma once

#include <poll.h>

#include "walker_sim/errors.h"
#include "walker_sim/export.h"

namespace walker {

/// A replacement for ::poll. @throws Interrupted if a signal has arrived that ends the operation
using Poll = int (*)(pollfd* files, nfds_t num_files, int timeout);

/// Sets the process-wide function that long operations call in the caller's thread. The default is
/// ::poll: a signal either ends the process or has no effect on the operation.
/// @param interrupts_steps whether steps call it, too; a server completes a step before it ends
WALKER_SIM_EXPORT void set_poll(Poll poll, bool interrupts_steps = false);

/// Polls one file with the host's `Poll`. The timeout is in ms, the result as ::poll's.
/// @throws Interrupted
int poll_interruptibly(pollfd& file, int timeout);

/// @throws Interrupted if a signal has arrived that ends the operation
void check_interruption();

/// Calls `check_interruption` if the host interrupts steps and this thread's last call is 50 ms
/// ago. Costs one clock reading if the host interrupts steps, else nothing.
void check_step_interruption();

}  // namespace walker
