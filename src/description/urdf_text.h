// Numbers and names of a robot description as text.
#pragma once

#include <string>

#include "walker_sim/specification.h"

namespace walker {

/// What the numbers of a description are, to the last digit.
enum class Precision { in_single, in_double };

/// Shortest text that reads back as the same number of this precision; 0 also for -0.
std::string number_text(double value, Precision precision);

/// The numbers with blanks between.
template <typename Numbers>
std::string list_text(const Numbers& numbers, Precision precision) {
  std::string text;
  for (const double number : numbers) {
    text += (text.empty() ? "" : " ") + number_text(number, precision);
  }
  return text;
}

/// A name as the value of an XML attribute.
std::string attribute_text(const std::string& name);

}  // namespace walker
