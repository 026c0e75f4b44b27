// Which models the kernel's constants cover.
#pragma once

#include <string>

#include "robots/mujoco/engine.h"
#include "robots/walker2d/kernel/ground.h"

namespace walker::walker2d {

/// The field of the model in which it differs from the kernel's constants; empty where in none that
/// a step reads.
std::string why_not_covered(const mjModel& model);

/// @param model covered
Ground ground_of(const mjModel& model);

}  // namespace walker::walker2d
