// A gait for Hopper, to have something that hops.
#pragma once

#include <vector>

#include "mujoco/linear_gait.h"

namespace walker::hopper {

/// Hops forward through whole episodes of Hopper-v4 and v5, about 16 m in 8 s.
///
/// The weights were found by augmented random search, V2-t, as those of walker2d/gait.h, on
/// Hopper-v5: 60 updates, each from the best 20 of 40 directions, step size 0.03, noise 0.03.
const std::vector<mujoco::MotorWeights>& gait();

}  // namespace walker::hopper
