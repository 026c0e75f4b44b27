// Walker2d's observation out of a robot's sensors.
#pragma once

#include <memory>

#include "walker2d/walker2d.h"
#include "walker_sim/observation_builder.h"

namespace walker::walker2d {

/// For the environment that the same options make.
/// @throws std::invalid_argument when the model is none
std::unique_ptr<ObservationBuilder> make_observation_builder(const Options& options);

}  // namespace walker::walker2d
