// Agents' commands: the held effort command, bounds of actions, and who steps. No ROS.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "base/checks.h"
#include "walker_sim/specification.h"

namespace walker {

/// Holds the latest effort command until the next or its timeout; without one the torque is zero.
class EffortCommand {
 public:
  enum class State { none, held, timed_out };

  /// @param timeout      [s]; 0: none
  /// @param in_wall_time whether age is measured in wall time; else in simulation time
  EffortCommand(const Specification& specification, double timeout, bool in_wall_time)
      : specification_(specification),
        timeout_(timeout),
        in_wall_time_(in_wall_time),
        action_(specification.action_size()),
        zero_(specification.action_size()) {}

  /// Takes a command, one effort per joint in action order [N m].
  /// @param now simulation time [ns]
  /// @throws InvalidAction naming the fault; then the held command stays
  void set(const std::vector<double>& efforts, std::uint64_t now) {
    check_action(specification_, efforts.data(), efforts.size(), "effort command", " N m");
    for (std::size_t i = 0; i < efforts.size(); ++i) {
      // With less than 1 N m per unit of action, the largest efforts overflow to an infinite
      // action.
      constexpr double kMax = std::numeric_limits<double>::max();
      const double action = efforts[i] / specification_.effort_per_action[i];
      action_[i] = std::clamp(action, -kMax, kMax);
    }
    state_ = State::held;
    set_at_ = time(now);
  }

  void clear() { state_ = State::none; }

  /// Selects the clock that measures the age of commands. A held command keeps its age.
  /// @param now simulation time [ns]
  void count_in_wall_time(bool in_wall_time, std::uint64_t now) {
    const std::int64_t age = time(now) - set_at_;
    in_wall_time_ = in_wall_time;
    set_at_ = time(now) - age;
  }

  /// Drops the held command if it has timed out at simulation time `now` [ns].
  /// @return whether it has just timed out
  bool expire(std::uint64_t now) {
    if (state_ != State::held || timeout_ == 0) return false;
    const std::chrono::duration<double> age = std::chrono::nanoseconds(time(now) - set_at_);
    if (age.count() < timeout_) return false;
    state_ = State::timed_out;
    return true;
  }

  /// Action of the next step: efforts over effort per unit of action, not limited to the bounds.
  const std::vector<double>& action() const { return state_ == State::held ? action_ : zero_; }

  State state() const { return state_; }

 private:
  /// Present time of the selected clock [ns].
  std::int64_t time(std::uint64_t now) const {
    if (!in_wall_time_) return static_cast<std::int64_t>(now);
    const auto since_boot = std::chrono::steady_clock::now().time_since_epoch();
    return std::chrono::nanoseconds(since_boot).count();
  }

  const Specification& specification_;
  double timeout_;
  bool in_wall_time_;
  std::vector<double> action_;
  std::vector<double> zero_;
  State state_ = State::none;
  std::int64_t set_at_ = 0;  // by the selected clock [ns]
};

/// Whether a value of the action is out of bounds and will be limited.
/// @param action specification.action_size() values
inline bool is_clamped(const Specification& specification, const double* action) {
  for (std::size_t i = 0; i < specification.action_size(); ++i) {
    if (action[i] < specification.action_low[i] || action[i] > specification.action_high[i]) {
      return true;
    }
  }
  return false;
}

/// Distinguishes two agents that step one walker in turns from an agent that replaces another.
class SteppingAgents {
 public:
  /// Forgets earlier callers: the new episode may belong to another agent.
  void clear() { *this = SteppingAgents(); }

  /// @param agent name of the node that made a step
  /// @return whether it resumes after the steps of another agent that had replaced it
  bool record(const std::string& agent) {
    if (agent == last_) return false;
    const bool comes_back = agent == other_;
    other_ = std::exchange(last_, agent);
    return comes_back;
  }

  /// The agent that stepped before the latest one; empty if none.
  const std::string& other() const { return other_; }

 private:
  std::string last_, other_;
};

}  // namespace walker
