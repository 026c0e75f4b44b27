// Random levels for MuJoCo's walkers.
#pragma once

#include <cmath>

#include "base/random.h"
#include "robots/mujoco/level_ground.h"

namespace walker::mujoco {

/// Draws values within the limits, half of them in the lowest tenth, of half of the parameters.
inline WorldValues random_level(Generator& generator) {
  for (;;) {
    WorldValues values;
    for (const WorldParameter& parameter : level_parameters()) {
      if (generator.integers(0, 2) == 0) continue;
      const double share = generator.integers(0, 2) == 0 ? 1 : 0.1;
      const double value = parameter.minimum + share * generator.uniform(0, 1) *
                                                   (parameter.maximum - parameter.minimum);
      values[parameter.name] = parameter.is_whole ? std::round(value) : value;
    }
    if (level_of(values)) return values;
  }
}

}  // namespace walker::mujoco
