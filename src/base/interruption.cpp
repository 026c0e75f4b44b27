#include "base/interruption.h"

#include <atomic>
#include <chrono>

namespace walker {
namespace {

std::atomic<Poll> host_poll{&::poll};
std::atomic<bool> host_interrupts_steps{false};

}  // namespace

void set_poll(Poll poll, bool interrupts_steps) {
  host_poll = poll;
  host_interrupts_steps = interrupts_steps;
}

int poll_interruptibly(pollfd& file, int timeout) { return host_poll.load()(&file, 1, timeout); }

void check_interruption() { host_poll.load()(nullptr, 0, 0); }

void check_step_interruption() {
  using Clock = std::chrono::steady_clock;
  constexpr std::chrono::milliseconds kInterval{50};
  thread_local Clock::time_point last;
  if (!host_interrupts_steps.load(std::memory_order_relaxed)) return;
  const Clock::time_point now = Clock::now();
  if (now - last < kInterval) return;
  last = now;
  check_interruption();
}

}  // namespace walker
