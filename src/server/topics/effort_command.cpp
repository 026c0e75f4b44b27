#include "server/topics/effort_command.h"

#include <algorithm>
#include <chrono>
#include <limits>

#include "base/checks.h"

namespace walker {

EffortCommand::EffortCommand(const Specification& specification, double timeout, bool in_wall_time)
    : specification_(specification),
      timeout_(timeout),
      in_wall_time_(in_wall_time),
      action_(specification.action_size()),
      zero_(specification.action_size()) {}

void EffortCommand::set(const std::vector<double>& efforts, std::uint64_t now) {
  check_action(specification_, efforts.data(), efforts.size(), "effort command", " N m");
  for (std::size_t i = 0; i < efforts.size(); ++i) {
    // With less than 1 N m per unit of action, the largest efforts overflow to an infinite action.
    constexpr double kMax = std::numeric_limits<double>::max();
    const double action = efforts[i] / specification_.effort_per_action[i];
    action_[i] = std::clamp(action, -kMax, kMax);
  }
  state_ = State::held;
  set_at_ = time(now);
}

/// Present time of the selected clock [ns].
std::int64_t EffortCommand::time(std::uint64_t now) const {
  if (!in_wall_time_) return static_cast<std::int64_t>(now);
  const auto since_boot = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::nanoseconds(since_boot).count();
}

void EffortCommand::count_in_wall_time(bool in_wall_time, std::uint64_t now) {
  const std::int64_t age = time(now) - set_at_;
  in_wall_time_ = in_wall_time;
  set_at_ = time(now) - age;
}

bool EffortCommand::expire(std::uint64_t now) {
  if (state_ != State::held || timeout_ == 0) return false;
  const std::chrono::duration<double> age = std::chrono::nanoseconds(time(now) - set_at_);
  if (age.count() < timeout_) return false;
  state_ = State::timed_out;
  return true;
}

bool is_clamped(const Specification& specification, const double* action) {
  for (std::size_t i = 0; i < specification.action_size(); ++i) {
    if (action[i] < specification.action_low[i] || action[i] > specification.action_high[i]) {
      return true;
    }
  }
  return false;
}

}  // namespace walker
