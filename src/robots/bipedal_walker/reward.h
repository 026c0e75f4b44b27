// Reward of a step.
#pragma once

#include <optional>

namespace walker::bipedal_walker {

/// Gymnasium's shaped reward: 130 / 30 per metre of progress (about 300 to the far end), minus 5
/// per radian of added hull tilt, minus 0.028 per joint at full torque; -100 instead for a fall.
///
/// The difference of shapings is computed in double precision. The costs are then subtracted in
/// single precision, as with float32 actions under NumPy 2.
class Reward {
 public:
  /// Begins an episode: the next step has no previous shaping.
  void restart() { previous_shaping_.reset(); }

  /// The entire state of a reward; empty right after `restart`.
  const std::optional<double>& previous_shaping() const { return previous_shaping_; }
  void set_previous_shaping(const std::optional<double>& shaping) { previous_shaping_ = shaping; }

  /// @param x      x of the hull's origin after the step [m]
  /// @param angle  hull angle after the step [rad]
  /// @param fell   whether the hull touched the ground or left the terrain behind the start
  /// @param action kJointCount values
  double of_step(double x, double angle, bool fell, const double* action);

 private:
  std::optional<double> previous_shaping_;
};

}  // namespace walker::bipedal_walker
