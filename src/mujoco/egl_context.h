// OpenGL by EGL.
#pragma once

#include <memory>

#include "mujoco/offscreen_context.h"

namespace walker::mujoco {

/// @throws std::runtime_error naming what is missing
std::unique_ptr<OffscreenContext> make_egl_context();

}  // namespace walker::mujoco
