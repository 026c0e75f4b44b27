// Conversion of worlds between messages and the core's types.
#pragma once

#include <optional>
#include <vector>

#include "walker_sim/World.h"
#include "walker_sim/WorldParameter.h"
#include "walker_sim/world.h"

namespace walker {

/// Returns a requested world; nullopt if the message is empty, which leaves the present one.
/// @throws std::invalid_argument naming a preset that does not exist, or a repeated parameter
std::optional<World> to_world(const walker_sim::World& message);

/// @throws std::invalid_argument naming a parameter that is repeated or is not a number
WorldValues to_values(const std::vector<walker_sim::WorldParameter>& message);

/// The message requests the same world; for Gymnasium's it has the preset.
void to_message(const World& world, walker_sim::World& message);

void to_message(const WorldValues& values, std::vector<walker_sim::WorldParameter>& message);

}  // namespace walker
