// OpenGL in software by OSMesa.
#pragma once

#include <memory>

#include "mujoco/offscreen_context.h"

namespace walker::mujoco {

/// @throws std::runtime_error naming what is missing
std::unique_ptr<OffscreenContext> make_osmesa_context();

}  // namespace walker::mujoco
