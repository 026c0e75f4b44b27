// What the walkers' lidars have in common: observed fractions, errors, parameters of worlds.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "walker_sim/sensors.h"
#include "walker_sim/specification.h"
#include "walker_sim/world.h"

namespace walker {

/// Writes each range over the maximum; 1: no hit.
inline void write_fractions(const double* ranges, std::size_t count, double maximum,
                            double* fractions) {
  std::transform(ranges, ranges + count, fractions,
                 [maximum](double range) { return std::min(range / maximum, 1.0); });
}

/// Adds errors to the ranges of rays that hit. The sums stay between 0 and the maximum.
void add_range_noise(const std::vector<double>& noise, double maximum, double* ranges);

/// Returns the maximum range of the measurements [m]. Where it is absent, or the specification's in
/// the single precision of a scan, it is the specification's.
double maximum_range_of(const Measurements& measurements, const RangeFinder& finder);

/// Returns the world's parameter lidar_range.
WorldParameter lidar_range_parameter(double default_range);

/// Returns the world's parameter range_noise.
WorldParameter range_noise_parameter();

}  // namespace walker
