#include "server/urdf_text.h"

#include <cstdlib>
#include <limits>
#include <sstream>

namespace walker {
namespace {

void read(const std::string& text, float& value) { value = std::strtof(text.c_str(), nullptr); }
void read(const std::string& text, double& value) { value = std::strtod(text.c_str(), nullptr); }

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
    read(text, again);
    if (again == value) break;
  }
  return text;
}

}  // namespace

std::string number_text(double value, Precision precision) {
  if (value == 0) value = 0;
  if (precision == Precision::in_single) return shortest_text(static_cast<float>(value));
  return shortest_text(value);
}

std::string attribute_text(const std::string& name) {
  std::string text;
  for (const char c : name) {
    switch (c) {
      case '&':
        text += "&amp;";
        break;
      case '<':
        text += "&lt;";
        break;
      case '"':
        text += "&quot;";
        break;
      default:
        text += c;
    }
  }
  return text;
}

}  // namespace walker
