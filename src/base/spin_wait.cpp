#include "base/spin_wait.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <exception>
#include <thread>

namespace walker {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kTrials = 9;
constexpr std::chrono::microseconds kAsleep{100};  // in which a blocked thread's core goes to sleep
constexpr int kPatience = 100;                     // [ms]

/// Measures how long a thread takes to run after an event has ended its wait.
/// @return the median
Clock::duration measure_waking(int event) {
  std::array<Clock::duration, kTrials> delays{};
  std::atomic<int> num_woken{0};
  std::atomic<Clock::time_point> signalled_at{Clock::time_point()};
  std::thread sleeper([&] {
    for (Clock::duration& delay : delays) {
      pollfd file{event, POLLIN, 0};
      ::poll(&file, 1, kPatience);
      delay = Clock::now() - signalled_at.load();
      eventfd_t ignored = 0;
      eventfd_read(event, &ignored);
      ++num_woken;
    }
  });
  for (int i = 0; i < kTrials; ++i) {
    while (num_woken < i) std::this_thread::yield();
    std::this_thread::sleep_for(kAsleep);
    signalled_at = Clock::now();
    eventfd_write(event, 1);
  }
  sleeper.join();
  std::nth_element(delays.begin(), delays.begin() + kTrials / 2, delays.end());
  return delays[kTrials / 2];
}

std::chrono::microseconds choose_limit() {
  constexpr int kWakings = 20;
  constexpr std::chrono::microseconds kLeast{50};
  constexpr std::chrono::microseconds kMost{kMaxSpinMicroseconds};
  const int event = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
  if (event < 0) return kLeast;
  Clock::duration waking{};
  try {
    waking = measure_waking(event);
    // NOLINTNEXTLINE(bugprone-empty-catch): without another thread there is nothing to measure
  } catch (const std::exception&) {
  }
  close(event);
  return std::clamp(std::chrono::duration_cast<std::chrono::microseconds>(kWakings * waking),
                    kLeast, kMost);
}

}  // namespace

std::chrono::microseconds spin_limit(std::int64_t microseconds) {
  if (microseconds != kChosenSpin) return std::chrono::microseconds(microseconds);
  static const std::chrono::microseconds chosen = choose_limit();
  return chosen;
}

}  // namespace walker
