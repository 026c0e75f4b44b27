#include "ros/private_parameters.h"

#include <charconv>
#include <cmath>
#include <stdexcept>

#include <ros/param.h>
#include <ros/this_node.h>
#include <xmlrpcpp/XmlRpcValue.h>

#include "base/limits.h"
#include "base/parameter_text.h"
#include "base/printable_text.h"

namespace walker {
namespace {

/// Returns an element of a list. Lists hold doubles, which cannot represent every integer from 2^53
/// on: a seed given as a string would change silently.
double element_number(const std::string& name, int index, XmlRpc::XmlRpcValue& element) {
  if (element.getType() == XmlRpc::XmlRpcValue::TypeInt) return static_cast<int>(element);
  if (element.getType() == XmlRpc::XmlRpcValue::TypeDouble) return static_cast<double>(element);
  const bool is_text = element.getType() == XmlRpc::XmlRpcValue::TypeString;
  const std::string text = is_text ? static_cast<std::string>(element) : element.toXml();
  const std::optional<double> number = is_text ? parse_number(text) : std::nullopt;
  const bool is_integer = text.find_first_not_of("+-0123456789") == std::string::npos;
  if (number && !(is_integer && std::abs(*number) >= kMaxExactInteger)) return *number;
  throw std::invalid_argument("parameter " + name + ": element " + std::to_string(index) + " = " +
                              printable(text) + ": must be a number" +
                              (number ? ", and an integer below 2^53 in size" : ""));
}

std::vector<double> to_list(const std::string& name, XmlRpc::XmlRpcValue& value) {
  std::vector<double> list;
  list.reserve(value.size());
  for (int i = 0; i < value.size(); ++i) list.push_back(element_number(name, i, value[i]));
  return list;
}

ParameterValue to_value(const std::string& name, XmlRpc::XmlRpcValue& value) {
  switch (value.getType()) {
    case XmlRpc::XmlRpcValue::TypeBoolean:
      return static_cast<bool>(value);
    case XmlRpc::XmlRpcValue::TypeInt:
      return std::int64_t{static_cast<int>(value)};
    case XmlRpc::XmlRpcValue::TypeDouble:
      return static_cast<double>(value);
    case XmlRpc::XmlRpcValue::TypeString:
      return static_cast<std::string>(value);
    case XmlRpc::XmlRpcValue::TypeArray:
      return to_list(name, value);
    default:
      throw std::invalid_argument("parameter " + name + " = " + printable(value.toXml()) +
                                  ": must be true or false, a number, a text or a list of numbers");
  }
}

/// Formats an integer without a decimal point, although a list holds it as a double.
std::string list_element_text(double number) {
  constexpr double kLimit = 9223372036854775808.0;  // 2^63, the first above std::int64_t
  const bool is_integer = number >= -kLimit && number < kLimit && std::nearbyint(number) == number;
  return is_integer ? std::to_string(static_cast<std::int64_t>(number)) : to_string(number);
}

}  // namespace

Parameters private_parameters() {
  const std::string prefix = ros::this_node::getName() + "/";
  std::vector<std::string> names;
  if (!ros::param::getParamNames(names)) {
    throw std::invalid_argument("parameters: the ROS master does not answer with their list");
  }
  Parameters found;
  for (const std::string& full : names) {
    if (full.compare(0, prefix.size(), prefix) != 0) continue;
    const std::string name = full.substr(prefix.size());
    XmlRpc::XmlRpcValue value;
    if (ros::param::get(full, value)) found[name] = to_value(name, value);
  }
  return found;
}

void take_as_text(const std::string& name, Parameters& parameters) {
  const auto found = parameters.find(name);
  if (found == parameters.end()) return;
  if (std::holds_alternative<std::int64_t>(found->second) ||
      std::holds_alternative<double>(found->second)) {
    found->second = to_string(found->second);
  } else if (const auto* list = std::get_if<std::vector<double>>(&found->second)) {
    std::string text;
    for (const double element : *list) {
      if (!text.empty()) text += ' ';
      text += list_element_text(element);
    }
    found->second = text;
  }
}

void take_numbers(const std::vector<ParameterDescription>& descriptions, Parameters& parameters) {
  for (const ParameterDescription& description : descriptions) {
    const auto found = parameters.find(description.name);
    if (found == parameters.end()) continue;
    const ParameterValue& model = description.default_value;
    const auto* const text = std::get_if<std::string>(&found->second);
    if (text == nullptr ||
        !(std::holds_alternative<std::int64_t>(model) || std::holds_alternative<double>(model))) {
      continue;
    }
    if (const std::optional<double> number = parse_number(*text)) found->second = *number;
  }
}

std::optional<std::uint64_t> parse_seed(const std::string& name, const std::string& text) {
  if (text.empty()) return std::nullopt;
  std::uint64_t seed = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, seed);
  if (error == std::errc() && stop == end) return seed;
  throw std::invalid_argument("parameter " + name + " = " + text +
                              ": must be a decimal integer in [0, 18446744073709551615], or empty");
}

}  // namespace walker
