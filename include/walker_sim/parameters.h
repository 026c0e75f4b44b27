// Typed, documented environment parameters.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <variant>
#include <vector>

#include "walker_sim/export.h"

namespace walker {

/// A value from a launch file, YAML or a Python keyword. Integers and doubles convert to each other
/// if the conversion is exact.
using ParameterValue = std::variant<bool, std::int64_t, double, std::string, std::vector<double>>;

using Parameters = std::map<std::string, ParameterValue>;

/// Meaning and allowed values of a parameter. Its type is the default value's.
struct ParameterDescription {
  std::string name;
  ParameterValue default_value;
  std::string unit;         ///< empty: unitless
  std::string description;  ///< one sentence
  double minimum;           ///< of a number or of each list element; otherwise unused
  double maximum;           ///< likewise
};

/// Formats a value so that YAML reads back the same value; doubles have the shortest exact form.
/// Strings are returned unchanged.
WALKER_SIM_EXPORT std::string to_string(const ParameterValue& value);

/// Returns the name in `known` nearest to `name` by edit distance; empty if none is near.
WALKER_SIM_EXPORT std::string nearest_name(const std::string& name,
                                           const std::vector<std::string>& known);

/// Completes `given` with the defaults of `descriptions`.
/// @throws std::invalid_argument naming the parameter, its value and the allowed values if a name
///         is unknown (with the nearest known name), a type is wrong or a number is out of range
WALKER_SIM_EXPORT Parameters
complete_parameters(const std::vector<ParameterDescription>& descriptions, const Parameters& given);

}  // namespace walker
