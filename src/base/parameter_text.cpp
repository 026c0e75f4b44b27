#include "base/parameter_text.h"

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <optional>
#include <sstream>
#include <stdexcept>

#include "base/printable_text.h"
#include "base/shortest_text.h"

namespace walker {
namespace {

/// Whether the number that a C function has parsed up to `end` is the whole text. C functions stop
/// at a zero byte and skip leading white space.
bool is_whole(const std::string& text, const char* end) {
  return !text.empty() && std::isspace(static_cast<unsigned char>(text.front())) == 0 &&
         end == text.c_str() + text.size();
}

std::optional<ParameterValue> read(const std::string& text, bool /*type*/) {
  if (text == "true") return true;
  if (text == "false") return false;
  return std::nullopt;
}

std::optional<ParameterValue> read(const std::string& text, std::int64_t /*type*/) {
  constexpr int kDecimal = 10;
  char* end = nullptr;
  errno = 0;
  const std::int64_t value = std::strtoll(text.c_str(), &end, kDecimal);
  if (!is_whole(text, end) || errno != 0) return std::nullopt;
  return value;
}

std::optional<ParameterValue> read(const std::string& text, double /*type*/) {
  if (const std::optional<double> number = parse_number(text)) return *number;
  return std::nullopt;
}

std::optional<ParameterValue> read(const std::string& text, const std::string& /*type*/) {
  return text;
}

std::optional<ParameterValue> read(const std::string& text, const std::vector<double>& /*type*/) {
  if (text.size() < 2 || text.front() != '[' || text.back() != ']') return std::nullopt;
  std::vector<double> list;
  std::istringstream elements(text.substr(1, text.size() - 2));
  for (std::string element; std::getline(elements, element, ',');) {
    element.erase(0, element.find_first_not_of(' '));
    element.erase(element.find_last_not_of(' ') + 1);
    const std::optional<double> number = parse_number(element);
    if (!number) return std::nullopt;
    list.push_back(*number);
  }
  return list;
}

}  // namespace

std::optional<double> parse_number(const std::string& text) {
  if (text == ".inf") return std::numeric_limits<double>::infinity();
  if (text == "-.inf") return -std::numeric_limits<double>::infinity();
  char* end = nullptr;
  errno = 0;
  const double value = strtod_l(text.c_str(), &end, c_locale());
  const bool is_too_large = errno == ERANGE && std::isinf(value);
  if (!is_whole(text, end) || is_too_large) return std::nullopt;
  return value;
}

Parameters parse_assignments(const std::vector<ParameterDescription>& descriptions,
                             const std::vector<std::string>& assignments) {
  Parameters parameters;
  for (const std::string& assignment : assignments) {
    const std::size_t equals = assignment.find('=');
    if (equals == std::string::npos || equals == 0) {
      throw std::invalid_argument(printable(assignment) + ": must be NAME=VALUE");
    }
    const std::string name = assignment.substr(0, equals);
    const std::string text = assignment.substr(equals + 1);
    const auto known = std::find_if(descriptions.begin(), descriptions.end(),
                                    [&](const ParameterDescription& d) { return d.name == name; });
    std::optional<ParameterValue> value;
    if (known != descriptions.end()) {
      value = std::visit([&](const auto& type) { return read(text, type); }, known->default_value);
    }
    if (!parameters.emplace(name, value.value_or(text)).second) {
      throw std::invalid_argument("parameter " + name + ": given twice");
    }
  }
  return parameters;
}

}  // namespace walker
