// Errors of sensors, added to what they measure.
#pragma once

#include "robots/robot.h"
#include "walker_sim/sensors.h"

namespace walker {

/// Adds the errors of one step to its measurements. Ranges of rays that hit stay between 0 and
/// `maximum_range`. Link poses other than the trunk's do not change.
void add(const SensorNoise& noise, Sensors& sensors);

}  // namespace walker
