#include "episode/parking.h"

#include <linux/futex.h>
#include <sched.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <thread>

namespace walker {
namespace {

// The kernel looks at the number's bytes.
static_assert(sizeof(std::atomic<std::uint32_t>) == sizeof(std::uint32_t));
static_assert(std::atomic<std::uint32_t>::is_always_lock_free);

/// Tells the processor that its thread only waits.
void relax() {
#ifdef __x86_64__
  __builtin_ia32_pause();
#elif defined(__aarch64__)
  asm volatile("yield");
#endif
}

}  // namespace

std::size_t num_processors() {
  cpu_set_t set;
  if (sched_getaffinity(0, sizeof(set), &set) != 0) return 1;  // more than the set has room for
  return static_cast<std::size_t>(std::max(CPU_COUNT(&set), 1));
}

bool wait_awake(const std::atomic<std::uint32_t>& number, std::uint32_t old, Awake awake) {
  using Clock = std::chrono::steady_clock;
  constexpr std::chrono::microseconds kLongest(150);  // docs/pool.md says why
  const Clock::time_point end = Clock::now() + kLongest;
  do {
    if (number.load(std::memory_order_acquire) != old) return true;
    if (awake == Awake::spins) {
      relax();
    } else {
      std::this_thread::yield();
    }
  } while (Clock::now() < end);
  return false;
}

void sleep_while(const std::atomic<std::uint32_t>& number, std::uint32_t old) {
  syscall(SYS_futex, &number, FUTEX_WAIT_PRIVATE, old, nullptr, nullptr, 0);
}

void wake(const std::atomic<std::uint32_t>& number, int count) {
  syscall(SYS_futex, &number, FUTEX_WAKE_PRIVATE, count, nullptr, nullptr, 0);
}

}  // namespace walker
