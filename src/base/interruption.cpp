#include "base/interruption.h"

#include <atomic>

namespace walker {
namespace {

std::atomic<Poll> host_poll{&::poll};

}  // namespace

void set_poll(Poll poll) { host_poll = poll; }

int poll_interruptibly(pollfd& file, int timeout) { return host_poll.load()(&file, 1, timeout); }

void check_interruption() { host_poll.load()(nullptr, 0, 0); }

}  // namespace walker
