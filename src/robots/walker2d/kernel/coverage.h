// Decides which models the kernel's constants cover.
#pragma once

#include <string>

#include "robots/mujoco/engine.h"
#include "robots/walker2d/kernel/kernel.h"

namespace walker::walker2d {

/// Returns the first field of the model that differs from the kernel's constants; empty if no field
/// that a step reads differs.
std::string unsupported_reason(const mjModel& model);

/// @param model must be covered
Ground ground_of(const mjModel& model);

}  // namespace walker::walker2d
