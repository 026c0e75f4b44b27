// Parses environment parameters from text: command lines, messages, recordings.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "walker_sim/export.h"
#include "walker_sim/parameters.h"

namespace walker {

/// @param what prefix of the message
/// @throws std::invalid_argument for a name that is not in `known`, with the nearest known name
[[noreturn]] WALKER_SIM_EXPORT void refuse_unknown(const std::string& what, const std::string& name,
                                                   const std::vector<std::string>& known);

/// Parses a number: strtod's syntax in the C locale, or YAML's .inf and -.inf. Returns std::nullopt
/// if the text is not exactly one number, or if the number overflows a double.
WALKER_SIM_EXPORT std::optional<double> parse_number(const std::string& text);

/// Parses NAME=VALUE texts. A value is parsed as the type of the parameter's default, in YAML's
/// syntax (true, 4, 0.5, text, [0.8, 2.0]). A value that does not parse, or whose parameter is
/// unknown, stays a string, which `make` refuses.
/// @param descriptions of the environment's parameters
/// @throws std::invalid_argument if a text is not NAME=VALUE, or a name is repeated
WALKER_SIM_EXPORT Parameters
parse_assignments(const std::vector<ParameterDescription>& descriptions,
                  const std::vector<std::string>& assignments);

}  // namespace walker
