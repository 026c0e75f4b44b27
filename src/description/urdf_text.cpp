#include "description/urdf_text.h"

#include "core/shortest_text.h"

namespace walker {

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
