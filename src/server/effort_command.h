// The held effort command of a free-running simulation. No ROS.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <vector>

#include "walker_sim/specification.h"

namespace walker {

/// Holds the newest effort command until the next, or until it is too old. Without one the torque
/// is zero.
class EffortCommand {
 public:
  using Clock = std::chrono::steady_clock;

  /// @param timeout     [s]; 0: never too old
  /// @param in_wall_time the age is counted in wall time, else in simulation time
  EffortCommand(const Specification& specification, double timeout, bool in_wall_time);

  /// Takes a command, one effort per joint in action order [N m].
  /// @param now simulation time [ns]
  /// @throws std::invalid_argument naming what is wrong; the held command stays
  void set(const std::vector<double>& efforts, std::uint64_t now);

  /// Forgets the held command.
  void clear();

  /// The action for a step that begins at simulation time `now` [ns]: effort over the joint's
  /// effort per unit of action, unlimited.
  const std::vector<double>& action(std::uint64_t now);

  /// A command was held and has become too old since.
  bool has_timed_out() const { return timed_out_; }

 private:
  bool is_too_old(std::uint64_t now) const;

  const Specification& specification_;
  double timeout_;
  bool in_wall_time_;
  std::vector<double> action_;
  std::vector<double> zero_;
  bool is_held_ = false;
  bool timed_out_ = false;
  std::uint64_t set_at_ = 0;
  Clock::time_point set_at_wall_{};
};

/// Some value of the action lies outside the bounds and will be limited.
bool is_clamped(const Specification& specification, const std::vector<double>& action);

}  // namespace walker
