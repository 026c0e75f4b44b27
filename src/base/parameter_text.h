// Environment parameters given as text: on a command line, in a message, in a recording.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "walker_sim/export.h"
#include "walker_sim/parameters.h"

namespace walker {

/// @param what stands before the message
/// @throws std::invalid_argument for a name that is not one of the known, with the nearest of them
[[noreturn]] void refuse_unknown(const std::string& what, const std::string& name,
                                 const std::vector<std::string>& known);

/// A number as YAML has it, .inf included; none where the text is not just that, every byte of it,
/// or where it is beyond what a double holds.
WALKER_SIM_EXPORT std::optional<double> parse_number(const std::string& text);

/// Reads NAME=VALUE texts. A value is read in the type of the parameter's default, as YAML has it
/// (true, 4, 0.5, a text, [0.8, 2.0]); one that cannot be stays a text, which `make` refuses.
/// @param descriptions of the parameters that the environment takes
/// @throws std::invalid_argument for a text without a name or given twice
WALKER_SIM_EXPORT Parameters
parse_assignments(const std::vector<ParameterDescription>& descriptions,
                  const std::vector<std::string>& assignments);

}  // namespace walker
