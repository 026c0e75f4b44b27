// Which actions and measurements are well-formed.
#pragma once

#include <cstddef>
#include <string>

#include "walker_sim/export.h"
#include "walker_sim/observation_builder.h"
#include "walker_sim/specification.h"

namespace walker {

/// @param action `size` values
/// @param what, unit how the message calls them
/// @throws InvalidAction when there is not one finite value per joint
WALKER_SIM_EXPORT void check_action(const Specification& specification, const double* action,
                                    std::size_t size, const char* what = "action",
                                    const char* unit = "");

/// The same of one of several environments' right number of values, which the message names.
WALKER_SIM_EXPORT void check_action_of(std::size_t environment, const Specification& specification,
                                       const double* action);

/// @param size of the actions of `num_envs` environments together
/// @throws InvalidAction when it is not theirs
WALKER_SIM_EXPORT void check_actions_size(const Specification& specification, std::size_t size,
                                          std::size_t num_envs);

/// Checks all but the position: sizes, numbers that are none, a quaternion that is no rotation.
/// @throws std::invalid_argument naming the measurement, its value and what is allowed
void check_measurements(const Measurements& measurements, const Specification& specification);

/// @param name of the measurement
/// @param unit as it follows a number
/// @throws std::invalid_argument where the value is not finite
void check_finite(const std::string& name, double value, const std::string& unit);

}  // namespace walker
