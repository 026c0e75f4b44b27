// Converts bodies, geoms, hinges and motors of a model to the specification's types.
#pragma once

#include <string>

#include "robots/mujoco/engine.h"
#include "robots/mujoco/layout.h"
#include "walker_sim/specification.h"

namespace walker::mujoco {

/// @param quaternion in MuJoCo's order, w first
Pose to_pose(const mjtNum* position, const mjtNum* quaternion);

std::string body_name(const mjModel& model, int body);

/// Returns mass, shapes and colour of a body and everything fixed to it, in the body's frame. The
/// shapes exclude planes, ellipsoids and meshes.
Link read_link(const mjModel& model, int body);

/// Returns the hinge that an element of the action drives, with its motor.
Joint read_joint(const mjModel& model, const Layout& layout, int action_index);

}  // namespace walker::mujoco
