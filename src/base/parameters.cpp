#include "walker_sim/parameters.h"

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <numeric>
#include <optional>
#include <sstream>
#include <stdexcept>

#include "base/limits.h"
#include "base/parameter_text.h"
#include "base/printable_text.h"
#include "base/shortest_text.h"

namespace walker {
namespace {

/// Formats a double so that it survives a round trip through text and YAML 1.1, where a number
/// without a decimal point is not a float, even with an exponent.
std::string number_text(double value) {
  if (std::isnan(value)) return ".nan";
  if (std::isinf(value)) return value > 0 ? ".inf" : "-.inf";
  std::string text = shortest_text(value);
  if (text.find('.') == std::string::npos) text.insert(std::min(text.find('e'), text.size()), ".0");
  return text;
}

std::size_t edit_distance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t substituted = diagonal + (a[i - 1] == b[j - 1] ? 0U : 1U);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, substituted});
    }
  }
  return row[b.size()];
}

const char* type_name(const ParameterValue& value) {
  constexpr const char* kNames[] = {"true or false", "an integer", "a number", "a text",
                                    "a list of numbers"};
  return kNames[value.index()];
}

std::string range_text(const ParameterDescription& description) {
  std::string minimum = number_text(description.minimum);
  std::string maximum = number_text(description.maximum);
  if (std::holds_alternative<std::int64_t>(description.default_value)) {
    minimum = std::to_string(static_cast<std::int64_t>(description.minimum));
    maximum = std::to_string(static_cast<std::int64_t>(description.maximum));
  }
  return "[" + minimum + ", " + maximum + "]";
}

[[noreturn]] void refuse(const ParameterDescription& description, const ParameterValue& value,
                         const std::string& allowed) {
  throw std::invalid_argument("parameter " + description.name + " = " +
                              printable(to_string(value)) + ": must be " + allowed);
}

/// Converts `value` to the type of the default.
/// @throws std::invalid_argument unless the conversion is exact
ParameterValue convert(const ParameterDescription& description, const ParameterValue& value) {
  const ParameterValue& model = description.default_value;
  if (value.index() == model.index()) return value;
  if (std::holds_alternative<double>(model) && std::holds_alternative<std::int64_t>(value)) {
    return static_cast<double>(std::get<std::int64_t>(value));
  }
  if (std::holds_alternative<std::int64_t>(model) && std::holds_alternative<double>(value)) {
    const double number = std::get<double>(value);
    if (std::nearbyint(number) == number && std::abs(number) <= kMaxExactInteger) {
      return static_cast<std::int64_t>(number);
    }
    refuse(description, value, "an integer in " + range_text(description));
  }
  refuse(description, value, type_name(model));
}

void check_number(const ParameterDescription& description, const ParameterValue& value,
                  double number) {
  // isnan comes first: comparing a NaN would raise a floating-point exception.
  if (std::isnan(number) || number < description.minimum || number > description.maximum) {
    refuse(description, value, std::string(type_name(value)) + " in " + range_text(description));
  }
}

void check_range(const ParameterDescription& description, const ParameterValue& value) {
  if (const auto* integer = std::get_if<std::int64_t>(&value)) {
    check_number(description, value, static_cast<double>(*integer));
  } else if (const auto* number = std::get_if<double>(&value)) {
    check_number(description, value, *number);
  } else if (const auto* list = std::get_if<std::vector<double>>(&value)) {
    const auto& model = std::get<std::vector<double>>(description.default_value);
    if (list->size() != model.size()) {
      refuse(description, value, "a list of " + std::to_string(model.size()) + " numbers");
    }
    for (const double element : *list) check_number(description, value, element);
  }
}

/// Whether the number that a C function has parsed up to `end` is the whole text. C functions stop
/// at a zero byte and skip leading white space.
bool is_whole(const std::string& text, const char* end) {
  return !text.empty() && std::isspace(static_cast<unsigned char>(text.front())) == 0 &&
         end == text.c_str() + text.size();
}

std::optional<std::int64_t> parse_integer(const std::string& text) {
  constexpr int kDecimal = 10;
  char* end = nullptr;
  errno = 0;
  const std::int64_t value = std::strtoll(text.c_str(), &end, kDecimal);
  if (!is_whole(text, end) || errno != 0) return std::nullopt;
  return value;
}

/// As parse_number, without hexadecimal numbers: YAML has those for integers only.
std::optional<double> parse_decimal(const std::string& text) {
  return text.find_first_of("xX") == std::string::npos ? parse_number(text) : std::nullopt;
}

std::optional<std::vector<double>> parse_list(const std::string& text) {
  if (text.size() < 2 || text.front() != '[' || text.back() != ']') return std::nullopt;
  std::vector<double> list;
  std::istringstream elements(text.substr(1, text.size() - 2));
  for (std::string element; std::getline(elements, element, ',');) {
    element.erase(0, element.find_first_not_of(' '));
    element.erase(element.find_last_not_of(' ') + 1);
    const std::optional<double> number = parse_decimal(element);
    if (!number) return std::nullopt;
    list.push_back(*number);
  }
  return list;
}

/// Parses a value of the model's type. Returns the text itself if it does not parse.
ParameterValue parse(const std::string& text, const ParameterValue& model) {
  if (std::holds_alternative<bool>(model) && (text == "true" || text == "false")) {
    return text == "true";
  }
  if (std::holds_alternative<std::int64_t>(model)) {
    if (const auto integer = parse_integer(text)) return *integer;
  } else if (std::holds_alternative<double>(model)) {
    if (const auto number = parse_decimal(text)) return *number;
  } else if (std::holds_alternative<std::vector<double>>(model)) {
    if (auto list = parse_list(text)) return *std::move(list);
  }
  return text;
}

auto find(const std::vector<ParameterDescription>& descriptions, const std::string& name) {
  return std::find_if(descriptions.begin(), descriptions.end(),
                      [&](const ParameterDescription& d) { return d.name == name; });
}

}  // namespace

std::string to_string(const ParameterValue& value) {
  struct Visitor {
    std::string operator()(bool flag) const { return flag ? "true" : "false"; }
    std::string operator()(std::int64_t integer) const { return std::to_string(integer); }
    std::string operator()(double number) const { return number_text(number); }
    std::string operator()(const std::string& text) const { return text; }
    std::string operator()(const std::vector<double>& list) const {
      std::string text = "[";
      for (const double number : list) {
        if (text.size() > 1) text += ", ";
        text += number_text(number);
      }
      return text + "]";
    }
  };
  return std::visit(Visitor{}, value);
}

std::string nearest_name(const std::string& name, const std::vector<std::string>& known) {
  std::string nearest;
  std::size_t smallest = std::max<std::size_t>(2, name.size() / 3) + 1;
  for (const std::string& candidate : known) {
    if (name.size() >= candidate.size() + smallest) continue;  // each extra byte is an edit
    const std::size_t distance = edit_distance(name, candidate);
    if (distance < smallest) {
      smallest = distance;
      nearest = candidate;
    }
  }
  return nearest;
}

void refuse_unknown(const std::string& what, const std::string& name,
                    const std::vector<std::string>& known) {
  const std::string near = nearest_name(printable(name), known);
  std::string message =
      printable(what) + ": unknown" + (near.empty() ? "." : "; did you mean " + near + "?");
  message += " Known:";
  for (const std::string& one : known) message += " " + one;
  throw std::invalid_argument(message);
}

Parameters complete_parameters(const std::vector<ParameterDescription>& descriptions,
                               const Parameters& given) {
  Parameters complete;
  std::vector<std::string> known;
  for (const ParameterDescription& description : descriptions) {
    complete[description.name] = description.default_value;
    known.push_back(description.name);
  }
  for (const auto& [name, value] : given) {
    const auto found = find(descriptions, name);
    if (found == descriptions.end()) {
      refuse_unknown("parameter " + name + " = " + to_string(value), name, known);
    }
    ParameterValue converted = convert(*found, value);
    check_range(*found, converted);
    complete[name] = std::move(converted);
  }
  return complete;
}

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
    const auto known = find(descriptions, name);
    const ParameterValue value =
        known == descriptions.end() ? text : parse(text, known->default_value);
    if (!parameters.emplace(name, value).second) {
      throw std::invalid_argument("parameter " + name + ": given twice");
    }
  }
  return parameters;
}

}  // namespace walker
