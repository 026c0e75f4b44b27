// A planar robot as MuJoCo draws it.
#pragma once

#include <memory>
#include <string>

#include "robots/mujoco/layout.h"
#include "walker_sim/parameters.h"
#include "walker_sim/renderer.h"

namespace walker::mujoco {

/// MuJoCo's own renderer. OpenGL's depth buffer holds for a depth z the value
/// (1 - near / z) / (1 - near / far), and 1 where there is nothing, which is the depth `far`. A sky
/// is drawn too, from 0.6 to 1 times `far` away. Where the model asks for several samples a pixel,
/// a depth is that of one of them, not of the pixel's middle.
/// @param robot  its name, for errors
/// @param camera complete
/// @throws std::invalid_argument when the model is none, or for a camera that it does not have
std::unique_ptr<Renderer> make_renderer(const PlanarModel& model, const std::string& robot,
                                        const Parameters& camera);

}  // namespace walker::mujoco
