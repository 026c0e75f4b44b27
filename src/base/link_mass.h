// The mass of a link as a parameter of worlds.
#pragma once

#include <limits>
#include <string>

#include "walker_sim/world.h"

namespace walker {

inline std::string mass_name(const std::string& link) { return link + "_mass"; }

/// @param minimum, maximum limits [kg]
inline WorldParameter mass_parameter(const std::string& link, double minimum, double maximum) {
  return {mass_name(link),
          "kg",
          "Mass of " + link + ", whatever mass_scale is; its inertia stays.",
          std::numeric_limits<double>::quiet_NaN(),
          minimum,
          maximum};
}

}  // namespace walker
