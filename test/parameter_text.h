// Parameter values written as text, by recordings and through the rollout tool's pipe.
#pragma once

#include <cstdlib>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "walker_sim/parameters.h"

namespace walker {

/// `true` and `false`, numbers, numbers with commas between them; anything else is a text.
inline ParameterValue parameter_value(const std::string& text) {
  if (text == "true" || text == "false") return text == "true";
  std::vector<double> numbers;
  std::istringstream parts(text);
  for (std::string part; std::getline(parts, part, ',');) {
    char* end = nullptr;
    numbers.push_back(std::strtod(part.c_str(), &end));
    if (part.empty() || *end != '\0') return text;
  }
  if (numbers.size() == 1) return numbers[0];
  return numbers;
}

/// `NAME=VALUE`.
inline std::pair<std::string, ParameterValue> parameter(const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos) throw std::invalid_argument(text + ": must be NAME=VALUE");
  return {text.substr(0, equals), parameter_value(text.substr(equals + 1))};
}

}  // namespace walker
