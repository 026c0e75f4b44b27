// Sizes of Walker2d, with which most tests of this room are made.
#pragma once

#include "robots/mujoco/planar_base.h"

namespace walker::mujoco {

constexpr int kJointCount = 6;
constexpr int kDegreesOfFreedom = kBaseJoints + kJointCount;
constexpr int kFrameSkip = 4;  // Gymnasium's default, engine steps a step

}  // namespace walker::mujoco
