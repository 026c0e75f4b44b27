#include "base/spin_wait.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <exception>
#include <thread>

namespace walker {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kTrials = 9;
constexpr std::chrono::microseconds kIdleTime{100};  // the core of a blocked thread falls asleep
constexpr int kTimeout = 1000;                       // [ms]

/// Measures how long a thread takes to run after an event has ended its wait.
/// @return the median
Clock::duration measure_waking(int event) {
  std::array<Clock::duration, kTrials> delays{};
  std::atomic<int> num_woken{0};
  std::atomic<Clock::time_point> signalled_at{Clock::time_point()};
  std::thread sleeper([&] {
    for (Clock::duration& delay : delays) {
      pollfd file{event, POLLIN, 0};
      while (::poll(&file, 1, kTimeout) < 0 && errno == EINTR) {
      }
      delay = Clock::now() - signalled_at.load();
      eventfd_t ignored = 0;
      eventfd_read(event, &ignored);
      ++num_woken;
    }
  });
  for (int i = 0; i < kTrials; ++i) {
    do {
      std::this_thread::sleep_for(kIdleTime);
    } while (num_woken < i);
    signalled_at = Clock::now();
    eventfd_write(event, 1);
  }
  sleeper.join();
  std::nth_element(delays.begin(), delays.begin() + kTrials / 2, delays.end());
  return delays[kTrials / 2];
}

std::chrono::microseconds choose_limit() {
  constexpr int kWakings = 20;
  constexpr std::chrono::microseconds kMinLimit{50};
  constexpr std::chrono::microseconds kMaxLimit{kMaxSpinMicroseconds};
  const int event = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
  if (event < 0) return kMinLimit;
  Clock::duration waking{};
  try {
    waking = measure_waking(event);
    // NOLINTNEXTLINE(bugprone-empty-catch): without another thread there is nothing to measure
  } catch (const std::exception&) {
  }
  close(event);
  return std::clamp(std::chrono::duration_cast<std::chrono::microseconds>(kWakings * waking),
                    kMinLimit, kMaxLimit);
}

}  // namespace

std::chrono::microseconds spin_limit(std::int64_t microseconds) {
  if (microseconds != kMeasuredSpin) return std::chrono::microseconds(microseconds);
  // Threads that come at once may all measure: a lock would stay locked in the child of a fork.
  static std::atomic<std::int64_t> chosen{0};
  if (chosen == 0) chosen = choose_limit().count();
  return std::chrono::microseconds(chosen);
}

}  // namespace walker
