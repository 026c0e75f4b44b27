#include "server/time/step_timing.h"

#include <algorithm>

namespace walker {
namespace {

double seconds(StepTiming::Clock::duration duration) {
  return std::chrono::duration<double>(duration).count();
}

}  // namespace

void StepTiming::step_begins(Clock::time_point now, Clock::duration period) {
  if (period == Clock::duration::zero()) {
    last_beginning_.reset();
    return;
  }
  if (last_beginning_) {
    const Clock::duration deviation = std::chrono::abs(now - *last_beginning_ - period);
    deviations_[intervals_ % kCapacity] = deviation;
    largest_deviation_ = std::max(largest_deviation_, deviation);
    ++intervals_;
  }
  last_beginning_ = now;
}

void StepTiming::step_took(Clock::duration duration) {
  ++steps_;
  total_ += duration;
  longest_ = std::max(longest_, duration);
}

StepTiming::Report StepTiming::report() {
  Report report;
  if (intervals_ > 0) {
    const std::size_t count = std::min<std::uint64_t>(intervals_, kCapacity);
    std::sort(deviations_.begin(), deviations_.begin() + count);
    // The smallest value that at least this many thousandths of all values do not exceed.
    const auto quantile = [this, count](std::size_t thousandths) {
      return seconds(deviations_[(count * thousandths + 999) / 1000 - 1]);
    };
    report.jitter =
        Jitter{quantile(500), quantile(990), quantile(999), seconds(largest_deviation_)};
  }
  if (steps_ > 0) {
    report.duration = Duration{seconds(total_) / static_cast<double>(steps_), seconds(longest_)};
  }
  intervals_ = 0;
  largest_deviation_ = Clock::duration::zero();
  steps_ = 0;
  total_ = Clock::duration::zero();
  longest_ = Clock::duration::zero();
  return report;
}

}  // namespace walker
