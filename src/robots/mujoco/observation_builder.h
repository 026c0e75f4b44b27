// Computes a planar robot's observation from its sensors' measurements.
#pragma once

#include <memory>

#include "robots/mujoco/planar_robot.h"
#include "walker_sim/observation_builder.h"

namespace walker::mujoco {

/// Creates the builder for the environment with the same options.
/// @throws std::invalid_argument if the model is not a planar robot (two slides and a hinge)
std::unique_ptr<ObservationBuilder> make_observation_builder(const PlanarOptions& options);

}  // namespace walker::mujoco
