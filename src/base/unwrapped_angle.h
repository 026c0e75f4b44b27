// An angle that counts whole turns.
#pragma once

#include <cmath>

namespace walker {

/// Engines count a body's turns; its orientation does not tell them.
class UnwrappedAngle {
 public:
  /// The next angle will be the one nearest to 0.
  void reset() { value_ = 0; }

  /// @param angle known but for whole turns [rad]
  /// @return the same angle, nearest to the last one returned [rad]
  double follow(double angle) {
    constexpr double kTurn = 2 * M_PI;
    value_ = angle + kTurn * std::round((value_ - angle) / kTurn);
    return value_;
  }

 private:
  double value_ = 0;
};

}  // namespace walker
