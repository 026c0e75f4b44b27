// Limit of the states that topics show, in wall time. No ROS.
#pragma once

#include <algorithm>
#include <chrono>

namespace walker {

/// Decides which states topics show: a token bucket. Showing a state takes one token; `rate` tokens
/// per second come, up to 500 or to `rate` if that is more. So many states are all shown after a
/// pause, and those that follow without one at the rate.
class TopicPace {
 public:
  using Clock = std::chrono::steady_clock;

  /// @param rate states per second of wall time; 0: no limit
  explicit TopicPace(double rate)
      : rate_(rate), capacity_(std::max(rate, 500.0)), tokens_(capacity_) {}

  /// Takes a token. @return false if there is none; then the state is not to be shown yet
  bool take(Clock::time_point now) {
    if (rate_ == 0) return true;
    const std::chrono::duration<double> passed = now - refilled_at_;
    tokens_ = std::min(capacity_, tokens_ + passed.count() * rate_);
    refilled_at_ = now;
    if (tokens_ < 1) return false;
    --tokens_;
    return true;
  }

 private:
  double rate_;
  double capacity_;
  double tokens_;
  Clock::time_point refilled_at_ = Clock::now();
};

}  // namespace walker
