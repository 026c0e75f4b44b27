// The held effort command of a free-running simulation. No ROS.
#pragma once

#include <cstdint>
#include <vector>

#include "walker_sim/specification.h"

namespace walker {

/// Holds the newest effort command until the next, or until it is too old. Without one the torque
/// is zero.
class EffortCommand {
 public:
  enum class State { none, held, timed_out };

  /// @param timeout      [s]; 0: never too old
  /// @param in_wall_time the age is counted in wall time, else in simulation time
  EffortCommand(const Specification& specification, double timeout, bool in_wall_time);

  /// Takes a command, one effort per joint in action order [N m].
  /// @param now simulation time [ns]
  /// @throws InvalidAction naming what is wrong; the held command stays
  void set(const std::vector<double>& efforts, std::uint64_t now);

  /// Forgets the held command, and that one has timed out.
  void clear() { state_ = State::none; }

  /// Counts the age of commands by the other clock from now on; a held one keeps the age it has.
  /// @param now simulation time [ns]
  void count_in_wall_time(bool in_wall_time, std::uint64_t now);

  /// Lets go of a command that is too old at simulation time `now` [ns]. @return whether it just
  /// did
  bool expire(std::uint64_t now);

  /// The action for the next step: effort over the joint's effort per unit of action, unlimited.
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
  std::int64_t set_at_ = 0;  // by the clock that counts [ns]
};

/// Some value of the action lies outside the bounds and will be limited.
/// @param action specification.action_size() values
bool is_clamped(const Specification& specification, const double* action);

}  // namespace walker
