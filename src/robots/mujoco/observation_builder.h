// A planar robot's observation out of its sensors.
#pragma once

#include <memory>

#include "robots/mujoco/planar_robot.h"
#include "walker_sim/observation_builder.h"

namespace walker::mujoco {

/// For the environment that the same options make.
/// @throws std::invalid_argument when the model is none
std::unique_ptr<ObservationBuilder> make_observation_builder(const PlanarOptions& options);

}  // namespace walker::mujoco
