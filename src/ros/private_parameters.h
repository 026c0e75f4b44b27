// A node's private parameters as typed values.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "walker_sim/parameters.h"

namespace walker {

/// Everything that is set below this node's name.
/// @throws std::invalid_argument naming a parameter whose type has no place here
Parameters private_parameters();

/// Turns a number, or a list of them, into text with blanks between, integers into decimal digits:
/// roslaunch and YAML guess a number where a text of digits is meant.
void take_as_text(const std::string& name, Parameters& parameters);

/// Turns each text that is wholly a number into that number where one is described: YAML 1.1 reads
/// 1e-3 and 1.0e3 as texts.
void take_numbers(const std::vector<ParameterDescription>& descriptions, Parameters& parameters);

/// @param name of the parameter, for the message
/// @return none for an empty text
/// @throws std::invalid_argument unless `text` is a decimal number below 2^64
std::optional<std::uint64_t> parse_seed(const std::string& name, const std::string& text);

}  // namespace walker
