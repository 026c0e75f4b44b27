// Validation of actions, measurements and options.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "walker_sim/export.h"
#include "walker_sim/sensors.h"
#include "walker_sim/specification.h"

namespace walker {

/// @param action `size` values
/// @param what, unit name and unit of the values in the error message
/// @throws InvalidAction unless there is one finite value per joint
WALKER_SIM_EXPORT void check_action(const Specification& specification, const double* action,
                                    std::size_t size, const char* what = "action",
                                    const char* unit = "");

/// Checks the action of one of several environments; the message names its index.
/// @param action `specification.action_size()` values
/// @throws InvalidAction if a value is non-finite
WALKER_SIM_EXPORT void check_action_of(std::size_t environment, const Specification& specification,
                                       const double* action);

/// @param size number of values in the actions of all `num_envs` environments
/// @throws InvalidAction if it is wrong
WALKER_SIM_EXPORT void check_actions_size(const Specification& specification, std::size_t size,
                                          std::size_t num_envs);

/// Checks generalized positions (qpos) and velocities (qvel).
/// @throws std::logic_error if the environment has none, std::invalid_argument naming the wrong
///         size or value
WALKER_SIM_EXPORT void check_coordinates(const Specification& specification,
                                         const std::vector<double>& position,
                                         const std::vector<double>& velocity);

/// Checks all measurements except the position: sizes, non-finite values, negative ranges, a
/// non-unit quaternion.
/// @throws std::invalid_argument naming the measurement, its value and the allowed values
void check_measurements(const Measurements& measurements, const Specification& specification);

/// @param name, unit of the value in the error message; the unit with a leading space
/// @throws std::invalid_argument if the value is non-finite
WALKER_SIM_EXPORT void check_finite(const std::string& name, double value, const std::string& unit);

/// @throws std::invalid_argument naming an option or index that is out of range
void check_number(const std::string& name, std::size_t value, std::size_t lowest,
                  std::size_t highest);

}  // namespace walker
