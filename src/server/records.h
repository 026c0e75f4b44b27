// Episode records between messages and the core.
#pragma once

#include "core/episode_record.h"
#include "walker_sim/EnvironmentSpec.h"
#include "walker_sim/EpisodeRecord.h"

namespace walker {

/// The environment's parameters, typed, as `make` takes them.
/// @throws std::invalid_argument for an unknown id, or names and values of different number
Parameters parameters_of(const walker_sim::EnvironmentSpec& message);

/// @throws std::invalid_argument naming fields of the message that do not fit each other
EpisodeRecord to_record(const walker_sim::EpisodeRecord& message);

}  // namespace walker
