// Unwraps an angle that is measured modulo whole turns.
#pragma once

#include <cmath>

namespace walker {

/// Tracks whole turns, which an engine's angle includes and an orientation does not.
class UnwrappedAngle {
 public:
  /// Makes the next angle the one nearest to 0.
  void reset() { value_ = 0; }

  /// @param angle modulo whole turns [rad]
  /// @return the equivalent angle nearest to the last one returned [rad]
  double follow(double angle) {
    constexpr double kTurn = 2 * M_PI;
    value_ = angle + kTurn * std::round((value_ - angle) / kTurn);
    return value_;
  }

 private:
  double value_ = 0;
};

}  // namespace walker
