// What a planar robot's environment tells about itself, read off the compiled model.
#pragma once

#include "robots/mujoco/layout.h"
#include "robots/mujoco/planar_robot.h"
#include "walker_sim/sensors.h"
#include "walker_sim/specification.h"

namespace walker::mujoco {

Specification make_specification(const PlanarOptions& options, const Layout& layout,
                                 const mjModel& model);

/// A floor at the height of the model's first plane; none without a plane. Needs a reset.
void describe_scene(const mjModel& model, const mjData& data, Scene& scene);

}  // namespace walker::mujoco
