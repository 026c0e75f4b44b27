// What the environment tells about itself, read off the compiled model.
#pragma once

#include "walker2d/layout.h"
#include "walker2d/mujoco.h"
#include "walker2d/walker2d.h"
#include "walker_sim/sensors.h"
#include "walker_sim/specification.h"

namespace walker::walker2d {

Specification make_specification(const Options& options, const Layout& layout,
                                 const mjModel& model);

/// A floor at the height of the model's first plane; none without a plane. Needs a reset.
void describe_scene(const mjModel& model, const mjData& data, Scene& scene);

Vector3 to_vector3(const mjtNum* vector);

/// In the world; needs `Physics::measure`.
Pose pose_of_body(const mjData& data, int body);

/// Whether the body, or one fixed to it, touches what does not move; needs `Physics::measure`.
bool touches_ground(const mjModel& model, const mjData& data, int body);

}  // namespace walker::walker2d
