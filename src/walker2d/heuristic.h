// A gait for Walker2d, to have something that walks.
#pragma once

#include <cstddef>

#include "walker_sim/export.h"

namespace walker::walker2d {

/// Walks forward through whole episodes of Walker2d-v4 and v5, about 26 m in 8 s: each motor's
/// control is a weighted sum of the observed positions and velocities, limited to [-1, 1].
///
/// The weights were found by augmented random search, V2-t (H. Mania, A. Guy, B. Recht: Simple
/// random search provides a competitive approach to reinforcement learning, 2018), on Walker2d-v5:
/// 90 updates, each from the best 30 of 40 directions, step size 0.03, noise 0.025. The
/// observations' means and deviations are folded in; five digits are left.
class WALKER_SIM_EXPORT Heuristic {
 public:
  static constexpr std::size_t kObservationSize = 17;

  /// @param observation kObservationSize values as Walker2d gives them without the current
  /// positions
  /// @param action      6 values, float32
  void act(const double* observation, double* action) const;
};

}  // namespace walker::walker2d
