// Walker2d's entries in the registry.
#pragma once

#include <vector>

#include "walker_sim/registry.h"

namespace walker::walker2d {

/// Walker2d-v4 and Walker2d-v5.
std::vector<Registration> registrations();

}  // namespace walker::walker2d
