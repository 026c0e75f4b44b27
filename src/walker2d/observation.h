// How an observation is laid out.
#pragma once

#include "walker2d/constants.h"

namespace walker::walker2d {

/// @param position, velocity kDegreesOfFreedom values, MuJoCo's qpos and qvel
/// @param exclude_x          the torso's x is not part of the observation
/// @param observation        positions, then velocities, these limited to kMostVelocity
void write_observation(const double* position, const double* velocity, bool exclude_x,
                       double* observation);

}  // namespace walker::walker2d
