// Specification and scene of a planar robot, read from the compiled model.
#pragma once

#include "robots/mujoco/layout.h"
#include "robots/mujoco/planar_robot.h"
#include "walker_sim/sensors.h"
#include "walker_sim/specification.h"

namespace walker::mujoco {

Vector3 to_vector3(const mjtNum* vector);

/// @param quaternion in MuJoCo's order, w first
Pose to_pose(const mjtNum* position, const mjtNum* quaternion);

Specification make_specification(const PlanarOptions& options, const Layout& layout,
                                 const mjModel& model);

/// Sets the floor to the height of the model's first plane, if any.
/// @param data of `Physics::measure`
void describe_scene(const mjModel& model, const mjData& data, Scene& scene);

}  // namespace walker::mujoco
