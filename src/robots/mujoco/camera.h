// From where a robot is seen.
#pragma once

#include <string>
#include <vector>

#include "robots/mujoco/engine.h"
#include "walker_sim/parameters.h"
#include "walker_sim/renderer.h"

namespace walker::mujoco {

/// Defaults are Gymnasium's (DEFAULT_CAMERA_CONFIG of hopper_v5.py and walker2d_v5.py, DEFAULT_SIZE
/// of mujoco_env.py), but for the camera itself: Gymnasium 1.4's does not follow the robot.
/// @param distance the default of that parameter [m]
std::vector<ParameterDescription> camera_parameters(double distance);

/// MuJoCo's camera that the parameters choose.
/// @throws std::invalid_argument naming the camera that the model does not have, and those it has
mjvCamera choose_camera(const mjModel& model, const Parameters& camera);

/// Size, focal length and depths of its pictures.
Camera describe_camera(const mjModel& model, const mjvCamera& chosen, const Parameters& camera);

/// Where the camera was, as an optical frame in the world: x to the right, y down, z forward.
Pose optical_frame(const mjvScene& scene);

}  // namespace walker::mujoco
