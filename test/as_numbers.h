// Worlds without ranges.
#pragma once

#include "walker_sim/world.h"

namespace walker {

/// Returns the world of these numbers.
inline World as_numbers(const WorldValues& values) {
  World world;
  for (const auto& [name, value] : values) world[name] = {value, value};
  return world;
}

}  // namespace walker
