// Conversion of worlds and episode records between messages and the core's types.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "episode/walker.h"
#include "walker_sim/EpisodeRecord.h"
#include "walker_sim/World.h"
#include "walker_sim/WorldParameter.h"
#include "walker_sim/world.h"

namespace walker {

/// Returns the environment's parameters with their types, as `make` takes them.
/// @throws std::invalid_argument for an unknown id, an empty or repeated name, or if the numbers of
///         names and values differ
Parameters parameters_of(const std::string& id, const std::vector<std::string>& names,
                         const std::vector<std::string>& values);

/// @throws std::invalid_argument if the numbers of parameter names and values differ, or naming a
///         repeated parameter of the world
EpisodeRecord to_record(const walker_sim::EpisodeRecord& message);

/// Writes what happened in the steps: actions, pushes, coordinates and checksums.
void to_message(EpisodeRecord&& record, walker_sim::EpisodeRecord& message);

/// Returns a requested world; nullopt if the message is empty, which leaves the present one.
/// @throws std::invalid_argument naming a preset that does not exist, or a repeated parameter
std::optional<World> to_world(const walker_sim::World& message);

/// The message requests the same world; for Gymnasium's it has the preset.
void to_message(const World& world, walker_sim::World& message);

/// @param drawn by an episode
void to_message(const World& drawn, std::vector<walker_sim::WorldParameter>& message);

}  // namespace walker
