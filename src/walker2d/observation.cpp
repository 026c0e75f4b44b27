#include "walker2d/observation.h"

#include <algorithm>

namespace walker::walker2d {

void write_observation(const double* position, const double* velocity, bool exclude_x,
                       double* observation) {
  const int first = exclude_x ? 1 : 0;
  double* const velocities = std::copy(position + first, position + kDegreesOfFreedom, observation);
  std::transform(velocity, velocity + kDegreesOfFreedom, velocities,
                 [](double v) { return std::clamp(v, -kMostVelocity, kMostVelocity); });
}

}  // namespace walker::walker2d
