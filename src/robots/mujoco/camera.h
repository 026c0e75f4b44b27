// A renderer's camera: its parameters, field of view and pose.
#pragma once

#include <string>
#include <vector>

#include "robots/mujoco/engine.h"
#include "walker_sim/parameters.h"
#include "walker_sim/renderer.h"

namespace walker::mujoco {

/// Returns the camera's parameters. Their defaults are Gymnasium's (DEFAULT_CAMERA_CONFIG of
/// hopper_v5.py and walker2d_v5.py, DEFAULT_SIZE of mujoco_env.py), except that the default camera
/// is the model's tracking camera; Gymnasium 1.4's does not follow the robot.
/// @param distance default of the parameter `distance` [m]
std::vector<ParameterDescription> camera_parameters(double distance);

/// Returns the MuJoCo camera that the parameters select.
/// @throws std::invalid_argument if the model lacks the camera; the message lists those it has
mjvCamera choose_camera(const mjModel& model, const Parameters& camera);

/// Returns the size, focal length and depth range of the camera's pictures.
Camera describe_camera(const mjModel& model, const mjvCamera& chosen, const Parameters& camera);

/// Returns the camera's optical frame in the world: x to the right, y down, z forward.
Pose optical_frame(const mjvScene& scene);

}  // namespace walker::mujoco
