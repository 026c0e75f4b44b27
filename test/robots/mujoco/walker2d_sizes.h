// Sizes of Walker2d, which most tests in this folder use.
#pragma once

#include "robots/mujoco/planar_model.h"

namespace walker::mujoco {

constexpr int kJointCount = 6;
constexpr int kDegreesOfFreedom = kBaseJoints + kJointCount;
constexpr int kFrameSkip = 4;  // Gymnasium's default; engine steps per step

}  // namespace walker::mujoco
