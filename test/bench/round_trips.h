// Measures the latency of consecutive calls.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <iostream>
#include <stdexcept>
#include <vector>

namespace walker::bench {

using Clock = std::chrono::steady_clock;

class RoundTrips {
 public:
  /// @param seconds duration of the measurement, in (0, 3600]
  explicit RoundTrips(double seconds) : seconds_(seconds) {
    if (!(seconds > 0 && seconds <= 3600)) {
      throw std::invalid_argument("--seconds = " + std::to_string(seconds) +
                                  "; must be above 0 and at most 3600");
    }
    constexpr double kMaxPerSecond = 1e6;  // an upper bound, so the vector never reallocates
    nanoseconds_.reserve(static_cast<std::size_t>(seconds * kMaxPerSecond));
  }

  /// @param call    the measured function
  /// @param between runs after each call; its time counts in the total, not in the latency
  template <typename Call, typename Between>
  void run(const Call& call, const Between& between) {
    constexpr int kCallsToWarmUp = 200;
    for (int i = 0; i < kCallsToWarmUp; ++i) {
      call();
      between();
    }
    const Clock::time_point begin = Clock::now();
    const auto duration =
        std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds_));
    for (Clock::time_point now = begin; now - begin < duration;) {
      const Clock::time_point called = now;
      call();
      const Clock::time_point answered = Clock::now();
      nanoseconds_.push_back(std::chrono::nanoseconds(answered - called).count());
      between();
      now = Clock::now();
    }
    seconds_ = std::chrono::duration<double>(Clock::now() - begin).count();
  }

  void print() {
    std::sort(nanoseconds_.begin(), nanoseconds_.end());
    std::cout << "{\"steps\": " << nanoseconds_.size() << ", \"seconds\": " << seconds_
              << ", \"latency_us\": {\"p50\": " << quantile(0.5) << ", \"p99\": " << quantile(0.99)
              << "}}\n";
  }

 private:
  /// [us]
  double quantile(double fraction) const {
    const auto last = static_cast<double>(nanoseconds_.size() - 1);
    constexpr double kPerMicrosecond = 1000;
    return static_cast<double>(nanoseconds_[static_cast<std::size_t>(fraction * last)]) /
           kPerMicrosecond;
  }

  double seconds_;
  std::vector<std::int64_t> nanoseconds_;
};

}  // namespace walker::bench
