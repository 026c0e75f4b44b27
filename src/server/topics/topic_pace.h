// Limit of the states that topics show, in wall time. No ROS.
#pragma once

#include <algorithm>
#include <chrono>

namespace walker {

/// Decides which states topics show. A state costs one unit of a credit that grows by `rate` units
/// per second and is at most a second's worth, but at least one: after a quiet second that many
/// states are all shown, and those that follow without a pause at the rate.
class TopicPace {
 public:
  using Clock = std::chrono::steady_clock;

  /// @param rate states per second of wall time; 0: no limit
  explicit TopicPace(double rate) : rate_(rate), most_(std::max(rate, 1.0)), credit_(most_) {}

  /// Takes the credit for a state. @return false if there is none; then it is not to be shown yet
  bool take(Clock::time_point now) {
    if (rate_ == 0) return true;
    credit_ =
        std::min(most_, credit_ + std::chrono::duration<double>(now - grown_at_).count() * rate_);
    grown_at_ = now;
    if (credit_ < 1) return false;
    --credit_;
    return true;
  }

  /// In what time a state's credit grows, at most a second.
  Clock::duration period() const {
    return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(1 / most_));
  }

 private:
  double rate_;
  double most_;
  double credit_;
  Clock::time_point grown_at_ = Clock::now();
};

}  // namespace walker
