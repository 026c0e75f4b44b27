// A node's private parameters as typed values.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "walker_sim/parameters.h"

namespace walker {

/// Reads all parameters in this node's private namespace.
/// @throws std::invalid_argument for an unsupported type, or if the master lists no parameters
Parameters private_parameters();

/// Converts a number or a list of numbers to text, separated by spaces, with integers as decimal
/// digits: roslaunch and YAML read a string of digits as a number.
void take_as_text(const std::string& name, Parameters& parameters);

/// Converts each string that is wholly a number to a number if the parameter's default is one:
/// YAML 1.1 reads 1e-3 and 1.0e3 as strings.
void take_numbers(const std::vector<ParameterDescription>& descriptions, Parameters& parameters);

/// @param name parameter's name for the error message
/// @return nullopt if `text` is empty
/// @throws std::invalid_argument if `text` is neither empty nor a decimal number below 2^64
std::optional<std::uint64_t> parse_seed(const std::string& name, const std::string& text);

}  // namespace walker
