// Numbers as short decimal texts that lose nothing.
#pragma once

#include <cstdlib>
#include <limits>
#include <sstream>
#include <string>

namespace walker {

inline void read_number(const std::string& text, float& value) {
  value = std::strtof(text.c_str(), nullptr);
}
inline void read_number(const std::string& text, double& value) {
  value = std::strtod(text.c_str(), nullptr);
}

/// The shortest decimal text that reads back as the same number, e.g. 0.1, 1e-07.
/// @tparam Number float or double
template <typename Number>
std::string shortest_text(Number value) {
  using Limits = std::numeric_limits<Number>;
  std::string text;
  // Trailing zeros are not printed, so the digits that every decimal text survives are not too
  // many for 0.1.
  for (int digits = Limits::digits10; digits <= Limits::max_digits10; ++digits) {
    std::ostringstream stream;
    stream.precision(digits);
    stream << value;
    text = stream.str();
    Number again{};
    read_number(text, again);
    if (again == value) break;
  }
  return text;
}

}  // namespace walker
