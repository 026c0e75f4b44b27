// Typed, documented environment parameters.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <variant>
#include <vector>

#include "walker_sim/export.h"

namespace walker {

/// A value as it comes from a launch file, YAML or a Python keyword. Integers and doubles convert
/// to each other where no information is lost.
using ParameterValue = std::variant<bool, std::int64_t, double, std::string, std::vector<double>>;

/// Parameter values by name.
using Parameters = std::map<std::string, ParameterValue>;

/// What a parameter means and which values it takes. The type is that of the default.
struct ParameterDescription {
  std::string name;
  ParameterValue default_value;
  std::string unit;         ///< "" where there is none
  std::string description;  ///< one sentence
  double minimum;           ///< smallest allowed number (each element of a list); unused otherwise
  double maximum;           ///< largest allowed number
};

/// The value as text that YAML reads back as the same value (doubles in a short exact form). A
/// text stays as it is.
WALKER_SIM_EXPORT std::string to_string(const ParameterValue& value);

/// The name out of `known` nearest to `name` by edit distance; empty when none is near.
WALKER_SIM_EXPORT std::string nearest_name(const std::string& name,
                                           const std::vector<std::string>& known);

/// Completes `given` with the defaults of `descriptions`.
/// @throws std::invalid_argument naming the parameter, its value and what is allowed when a name is
///         unknown (with the nearest known name), a type is wrong or a number is out of range.
WALKER_SIM_EXPORT Parameters
complete_parameters(const std::vector<ParameterDescription>& descriptions, const Parameters& given);

}  // namespace walker
