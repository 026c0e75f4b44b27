// Parameters of worlds that each link of a robot has: its mass and a force on it.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "walker_sim/world.h"

namespace walker {

inline std::string mass_name(const std::string& link) { return link + "_mass"; }

/// @param axis 'x' or 'z', of the world
inline std::string force_name(const std::string& link, char axis) {
  return link + "_force_" + axis;
}

inline bool is_force_name(const std::string& name) {
  constexpr std::size_t kSize = 8;
  const std::string end = name.size() > kSize ? name.substr(name.size() - kSize) : "";
  return end == "_force_x" || end == "_force_z";
}

/// @param minimum, maximum limits [kg]
inline WorldParameter mass_parameter(const std::string& link, double minimum, double maximum) {
  return {mass_name(link),
          "kg",
          "Mass of " + link + ", whatever mass_scale is; its inertia stays.",
          std::numeric_limits<double>::quiet_NaN(),
          minimum,
          maximum};
}

/// @param maximum limit of the magnitude [N]
inline WorldParameter force_parameter(const std::string& link, char axis, double maximum) {
  const std::string direction = axis == 'x' ? "forwards" : "upwards";
  return {force_name(link, axis),
          "N",
          "Constant force on " + link + ", " + direction + ".",
          0,
          -maximum,
          maximum};
}

/// Appends the parameters of forces on links. Limbs are light and bear less than the trunk.
/// @param links the trunk first
/// @param push_impulse default of the impulse of pushes [N s]
inline void add_force_parameters(const std::vector<std::string>& links, double push_impulse,
                                 std::vector<WorldParameter>& parameters) {
  // In pushes a second; on the trunk as many as one push can have.
  constexpr double kMaxOnTrunk = 20;
  constexpr double kMaxOnLimb = 5;
  for (const std::string& link : links) {
    const double most = &link == &links.front() ? kMaxOnTrunk : kMaxOnLimb;
    for (const char axis : {'x', 'z'}) {
      parameters.push_back(force_parameter(link, axis, most * push_impulse));
    }
  }
}

}  // namespace walker
