// OpenGL in software by OSMesa.
#pragma once

#include <memory>

#include "walker2d/offscreen_context.h"

namespace walker::walker2d {

/// @throws std::runtime_error naming what is missing
std::unique_ptr<OffscreenContext> make_osmesa_context();

}  // namespace walker::walker2d
