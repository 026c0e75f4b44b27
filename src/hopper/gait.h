// A gait for Hopper, to have something that hops.
#pragma once

#include <vector>

#include "mujoco/linear_gait.h"

namespace walker::hopper {

const std::vector<mujoco::MotorWeights>& gait();

}  // namespace walker::hopper
