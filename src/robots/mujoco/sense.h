// Computes a robot's sensor measurements from mjData, which must be that of `Physics::measure`.
#pragma once

#include "robots/mujoco/layout.h"
#include "walker_sim/sensors.h"

namespace walker::mujoco {

/// Writes joints, link poses, foot contacts and gravity.
void sense(const mjModel& model, const mjData& data, const Layout& layout, Sensors& sensors);

/// Writes the trunk's velocities and acceleration.
/// @param velocity_before_step MuJoCo's qvel
/// @param dt                   duration of the step [s]
void sense_motion(const mjData& data, const double* velocity_before_step, double dt,
                  Sensors& sensors);

}  // namespace walker::mujoco
