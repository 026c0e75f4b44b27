// What sensors on a robot measure, read off MuJoCo's state.
#pragma once

#include "robots/mujoco/layout.h"
#include "walker_sim/sensors.h"

namespace walker::mujoco {

/// Joints, poses of the links, contacts of the feet, gravity. Needs `Physics::measure`.
void sense(const mjModel& model, const mjData& data, const Layout& layout, Sensors& sensors);

/// How the trunk moves. Needs `Physics::measure`.
/// @param velocity_before_step MuJoCo's qvel
/// @param dt                   of the step [s]
void sense_motion(const mjData& data, const double* velocity_before_step, double dt,
                  Sensors& sensors);

Vector3 to_vector3(const mjtNum* vector);

/// In the world; needs `Physics::measure`.
Pose pose_of_body(const mjData& data, int body);

/// Whether the body, or one fixed to it, touches what does not move; needs `Physics::measure`.
bool touches_ground(const mjModel& model, const mjData& data, int body);

}  // namespace walker::mujoco
