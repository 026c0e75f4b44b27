// Episode records between messages and the core.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "episode/episode_record.h"
#include "walker_sim/EnvironmentSpec.h"
#include "walker_sim/Episode.h"
#include "walker_sim/EpisodeRecord.h"

namespace walker {

/// The environment's parameters, typed, as `make` takes them.
/// @throws std::invalid_argument for an unknown id, or names and values of different number
Parameters parameters_of(const std::string& id, const std::vector<std::string>& names,
                         const std::vector<std::string>& values);
Parameters parameters_of(const walker_sim::EnvironmentSpec& message);

/// The seed with which an episode began; none: the generator continued.
std::optional<std::uint64_t> seed_of(const walker_sim::Episode& message);

/// The generator's state before the reset.
GeneratorState generator_state_of(const walker_sim::Episode& message);

/// @throws std::invalid_argument naming fields of the message that do not fit each other
EpisodeRecord to_record(const walker_sim::EpisodeRecord& message);

}  // namespace walker
