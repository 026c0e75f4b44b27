// OpenGL by EGL.
#pragma once

#include <memory>

#include "walker2d/offscreen_context.h"

namespace walker::walker2d {

/// @throws std::runtime_error naming what is missing
std::unique_ptr<OffscreenContext> make_egl_context();

}  // namespace walker::walker2d
