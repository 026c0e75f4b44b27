// Which measurements an observation can be made of.
#pragma once

#include <string>

#include "walker_sim/observation_builder.h"
#include "walker_sim/specification.h"

namespace walker {

/// Checks all but the position: sizes, numbers that are none, a quaternion that is no rotation.
/// @throws std::invalid_argument naming the measurement, its value and what is allowed
void check_measurements(const Measurements& measurements, const Specification& specification);

/// @param name of the measurement
/// @throws std::invalid_argument where the value is not finite
void check_finite(const std::string& name, double value, const std::string& unit);

}  // namespace walker
