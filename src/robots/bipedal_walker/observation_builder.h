// Builds BipedalWalker's observation from a robot's sensors.
#pragma once

#include <memory>

#include "robots/bipedal_walker/bipedal_walker.h"
#include "walker_sim/observation_builder.h"

namespace walker::bipedal_walker {

std::unique_ptr<ObservationBuilder> make_observation_builder(const Options& options);

}  // namespace walker::bipedal_walker
