#include "server/effort_command.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

namespace walker {

EffortCommand::EffortCommand(const Specification& specification, double timeout, bool in_wall_time)
    : specification_(specification),
      timeout_(timeout),
      in_wall_time_(in_wall_time),
      action_(specification.action_size()),
      zero_(specification.action_size()) {}

void EffortCommand::set(const std::vector<double>& efforts, std::uint64_t now) {
  if (efforts.size() != action_.size()) {
    throw std::invalid_argument("effort command has " + std::to_string(efforts.size()) +
                                " values; must have " + std::to_string(action_.size()) +
                                ", one per joint");
  }
  for (std::size_t i = 0; i < efforts.size(); ++i) {
    if (!std::isfinite(efforts[i])) {
      throw std::invalid_argument("effort command[" + std::to_string(i) + "] (" +
                                  specification_.joints[i].name +
                                  ") = " + std::to_string(efforts[i]) + " N m; must be finite");
    }
  }
  for (std::size_t i = 0; i < efforts.size(); ++i) {
    // Motors weaker than 1 N m turn the largest efforts into an infinite action.
    constexpr double kLargest = std::numeric_limits<double>::max();
    const double action = efforts[i] / specification_.effort_per_action[i];
    action_[i] = std::clamp(action, -kLargest, kLargest);
  }
  is_held_ = true;
  timed_out_ = false;
  set_at_ = now;
  set_at_wall_ = Clock::now();
}

void EffortCommand::clear() {
  is_held_ = false;
  timed_out_ = false;
}

const std::vector<double>& EffortCommand::action(std::uint64_t now) {
  if (is_held_ && is_too_old(now)) {
    is_held_ = false;
    timed_out_ = true;
  }
  return is_held_ ? action_ : zero_;
}

bool EffortCommand::is_too_old(std::uint64_t now) const {
  if (timeout_ == 0) return false;
  constexpr double kNanosecond = 1e-9;
  const double age = in_wall_time_
                         ? std::chrono::duration<double>(Clock::now() - set_at_wall_).count()
                         : static_cast<double>(now - set_at_) * kNanosecond;
  return age >= timeout_;
}

bool is_clamped(const Specification& specification, const std::vector<double>& action) {
  for (std::size_t i = 0; i < action.size(); ++i) {
    if (action[i] < specification.action_low[i] || action[i] > specification.action_high[i]) {
      return true;
    }
  }
  return false;
}

}  // namespace walker
