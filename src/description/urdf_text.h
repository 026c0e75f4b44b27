// Text of the numbers in a robot description.
#pragma once

#include <string>

#include "base/shortest_text.h"

namespace walker {

enum class Precision { in_single, in_double };

/// Returns the shortest text that reads back as the same number of this precision; 0 for -0.
inline std::string number_text(double value, Precision precision) {
  if (value == 0) value = 0;
  if (precision == Precision::in_single) return shortest_text(static_cast<float>(value));
  return shortest_text(value);
}

template <typename Numbers>
std::string list_text(const Numbers& numbers, Precision precision) {
  std::string text;
  for (const double number : numbers) {
    text += (text.empty() ? "" : " ") + number_text(number, precision);
  }
  return text;
}

}  // namespace walker
