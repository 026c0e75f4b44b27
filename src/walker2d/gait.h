// A gait for Walker2d, to have something that walks.
#pragma once

#include <vector>

#include "mujoco/linear_gait.h"

namespace walker::walker2d {

/// Walks forward through whole episodes of Walker2d-v4 and v5, about 26 m in 8 s.
///
/// The weights were found by augmented random search, V2-t (H. Mania, A. Guy, B. Recht: Simple
/// random search provides a competitive approach to reinforcement learning, 2018), on Walker2d-v5:
/// 90 updates, each from the best 30 of 40 directions, step size 0.03, noise 0.025. The
/// observations' means and deviations are folded in; five digits are left.
const std::vector<mujoco::MotorWeights>& gait();

}  // namespace walker::walker2d
