// Renders a planar robot with MuJoCo.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "robots/mujoco/planar_model.h"
#include "walker_sim/parameters.h"
#include "walker_sim/renderer.h"

namespace walker::mujoco {

/// Returns the camera's parameters. Their defaults are Gymnasium's (DEFAULT_CAMERA_CONFIG of
/// hopper_v5.py and walker2d_v5.py, DEFAULT_SIZE of mujoco_env.py), except that the default camera
/// is the model's tracking camera; Gymnasium 1.4's does not follow the robot.
/// @param distance default of the parameter `distance` [m]
std::vector<ParameterDescription> camera_parameters(double distance);

/// Creates a renderer that draws with MuJoCo's own. For a depth z, OpenGL's depth buffer holds
/// (1 - near / z) / (1 - near / far); the background has the value 1, which is the depth `far`.
/// MuJoCo also draws a sky, 0.6 to 1 times `far` away. If the model requests multisampling, a depth
/// is that of one sample, not of the pixel's centre.
/// @param robot  name for error messages
/// @param camera complete parameters
/// @throws std::invalid_argument if the model is not a planar robot or lacks the camera
std::unique_ptr<Renderer> make_renderer(const PlanarModel& model, const std::string& robot,
                                        const Parameters& camera);

}  // namespace walker::mujoco
