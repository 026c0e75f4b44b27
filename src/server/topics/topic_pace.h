// Limit of the states that topics show, in wall time. No ROS.
#pragma once

#include <algorithm>
#include <chrono>

namespace walker {

/// Decides which states topics show. A state costs one unit of a credit that grows by `rate` units
/// per second, to at most 500 units or those of a second: so many states are all shown after a
/// pause, and those that follow without one at the rate.
class TopicPace {
 public:
  using Clock = std::chrono::steady_clock;

  /// @param rate states per second of wall time; 0: no limit
  explicit TopicPace(double rate) : rate_(rate), most_(std::max(rate, 500.0)), credit_(most_) {}

  /// Takes the credit for a state. @return false if there is none; then it is not to be shown yet
  bool take(Clock::time_point now) {
    if (rate_ == 0) return true;
    const std::chrono::duration<double> passed = now - grown_at_;
    credit_ = std::min(most_, credit_ + passed.count() * rate_);
    grown_at_ = now;
    if (credit_ < 1) return false;
    --credit_;
    return true;
  }

 private:
  double rate_;
  double most_;
  double credit_;
  Clock::time_point grown_at_ = Clock::now();
};

}  // namespace walker
