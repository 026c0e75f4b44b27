// Conversion of episode records from messages to the core's types.
#pragma once

#include <string>
#include <vector>

#include "episode/episode.h"
#include "walker_sim/EpisodeRecord.h"

namespace walker {

/// Returns the environment's parameters with their types, as `make` takes them.
/// @throws std::invalid_argument for an unknown id, an empty or repeated name, or if the numbers of
///         names and values differ
Parameters parameters_of(const std::string& id, const std::vector<std::string>& names,
                         const std::vector<std::string>& values);

/// @throws std::invalid_argument if the numbers of parameter names and values differ, or as
///         `to_values`
EpisodeRecord to_record(const walker_sim::EpisodeRecord& message);

/// Writes what happened in the steps: actions, pushes and checksums.
void to_message(EpisodeRecord&& record, walker_sim::EpisodeRecord& message);

}  // namespace walker
