// Bodies, geoms, hinges and motors of a model in the terms of the specification.
#pragma once

#include <string>

#include "robots/mujoco/engine.h"
#include "robots/mujoco/layout.h"
#include "walker_sim/specification.h"

namespace walker::mujoco {

/// @param quaternion MuJoCo's, w first
Pose to_pose(const mjtNum* position, const mjtNum* quaternion);

std::string body_name(const mjModel& model, int body);

/// Mass, shapes and colour of a body and of all that is fixed to it, in the body's frame. Planes,
/// ellipsoids and meshes are left out of the shapes.
Link read_link(const mjModel& model, int body);

/// The hinge that an action's element drives, with its motor.
Joint read_joint(const mjModel& model, const Layout& layout, int action_index);

}  // namespace walker::mujoco
