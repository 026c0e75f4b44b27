// Hopper's entries in the registry.
#pragma once

#include <vector>

#include "walker_sim/registry.h"

namespace walker::hopper {

/// Hopper-v4 and Hopper-v5.
std::vector<Registration> registrations();

}  // namespace walker::hopper
