// What a step is worth.
#pragma once

#include <optional>

namespace walker::bipedal_walker {

/// Gymnasium's shaped reward: progress (130 / 30 a metre, about 300 to the far end), less 5 per
/// radian by which the hull tilts further, less 0.028 per joint at full torque; -100 instead for a
/// fall.
///
/// The difference of shapings is taken in double and then, as with float32 actions under NumPy 2,
/// the costs are subtracted in single precision.
class Reward {
 public:
  /// An episode begins: the next step has nothing to compare with.
  void restart() { previous_shaping_.reset(); }

  /// All that a reward remembers; none right after `restart`.
  const std::optional<double>& previous_shaping() const { return previous_shaping_; }
  void set_previous_shaping(const std::optional<double>& shaping) { previous_shaping_ = shaping; }

  /// @param x      of the hull's origin after the step [m]
  /// @param angle  of the hull after the step [rad]
  /// @param fell   the hull touched the ground or left the terrain behind the start
  /// @param action of the step, kJointCount values
  double of_step(double x, double angle, bool fell, const double* action);

 private:
  std::optional<double> previous_shaping_;
};

}  // namespace walker::bipedal_walker
