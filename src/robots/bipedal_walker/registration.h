// BipedalWalker's entries in the registry.
#pragma once

#include <vector>

#include "walker_sim/registry.h"

namespace walker::bipedal_walker {

/// BipedalWalker-v3 and BipedalWalkerHardcore-v3.
std::vector<Registration> registrations();

}  // namespace walker::bipedal_walker
