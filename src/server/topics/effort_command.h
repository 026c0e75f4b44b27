// The held effort command of a free-running simulation. No ROS.
#pragma once

#include <cstdint>
#include <vector>

#include "walker_sim/specification.h"

namespace walker {

/// Holds the latest effort command until the next or its timeout; without one the torque is zero.
class EffortCommand {
 public:
  enum class State { none, held, timed_out };

  /// @param timeout      [s]; 0: none
  /// @param in_wall_time whether age is measured in wall time; else in simulation time
  EffortCommand(const Specification& specification, double timeout, bool in_wall_time);

  /// Takes a command, one effort per joint in action order [N m].
  /// @param now simulation time [ns]
  /// @throws InvalidAction naming the fault; then the held command stays
  void set(const std::vector<double>& efforts, std::uint64_t now);

  void clear() { state_ = State::none; }

  /// Selects the clock that measures the age of commands. A held command keeps its age.
  /// @param now simulation time [ns]
  void count_in_wall_time(bool in_wall_time, std::uint64_t now);

  /// Drops the held command if it has timed out at simulation time `now` [ns].
  /// @return whether it has just timed out
  bool expire(std::uint64_t now);

  /// Action of the next step: efforts over effort per unit of action, not limited to the bounds.
  const std::vector<double>& action() const { return state_ == State::held ? action_ : zero_; }

  State state() const { return state_; }

 private:
  std::int64_t time(std::uint64_t now) const;

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
bool is_clamped(const Specification& specification, const double* action);

}  // namespace walker
