#include "ros/node_arguments.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <stdexcept>

#include <ros/names.h>

namespace walker {
namespace {

constexpr const char* kAssignment = ":=";
// ROS's special keys, without their two leading underscores.
constexpr std::array<const char*, 6> kSettings{"hostname", "ip", "log", "master", "name", "ns"};

std::vector<std::string> parameter_names(const NodeDescription& node) {
  std::vector<std::string> names = node.more_parameters;
  for (const ParameterDescription& parameter : node.parameters) names.push_back(parameter.name);
  return names;
}

template <typename Names>
bool contains(const Names& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

/// Prefix of the argument that was probably meant, e.g. "_env:=" or "__name:="; empty if unknown.
std::string probable_beginning(const std::string& name, const NodeDescription& node) {
  if (contains(parameter_names(node), name)) return "_" + name + kAssignment;
  if (contains(kSettings, name)) return "__" + name + kAssignment;
  return {};
}

/// Converts e.g. "--camera-width" to "camera_width".
std::string bare_name(std::string text) {
  text.erase(0, std::min(text.find_first_not_of("-_~/"), text.size()));
  std::replace(text.begin(), text.end(), '-', '_');
  return text;
}

[[noreturn]] void refuse(const std::string& argument, const std::string& allowed) {
  throw std::invalid_argument("argument " + argument + ": " + allowed);
}

[[noreturn]] void refuse_word(const std::string& argument, const NodeDescription& node) {
  const std::size_t equals = argument.find('=');
  const std::string name = bare_name(argument.substr(0, equals));
  std::string beginning = probable_beginning(name, node);
  if (beginning.empty()) {
    const std::string nearest = nearest_name(name, parameter_names(node));
    if (!nearest.empty()) beginning = "_" + nearest + kAssignment;
  }
  const std::string value = equals == std::string::npos ? "VALUE" : argument.substr(equals + 1);
  refuse(argument,
         "must be _PARAMETER:=VALUE or NAME:=NAME" +
             (beginning.empty() ? "; see --help" : "; did you mean " + beginning + value + "?"));
}

void check_name(const std::string& argument, const std::string& name) {
  std::string error;
  if (!ros::names::validate(name, error)) refuse(argument, "is not a valid name: " + error);
}

}  // namespace

std::string help_text(const NodeDescription& node) {
  std::string text =
      "Usage: rosrun walker_sim " + node.program +
      " [_PARAMETER:=VALUE ...] [NAME:=NAME ...] [__name:=NODE] [__ns:=NAMESPACE]\n" +
      node.summary + "\n";
  if (!node.parameters.empty()) text += "\nParameters, with their defaults:\n";
  for (const ParameterDescription& parameter : node.parameters) {
    text += "  _" + parameter.name + kAssignment + to_string(parameter.default_value) +
            (parameter.unit.empty() ? "" : " [" + parameter.unit + "]") + "\n      " +
            parameter.description + "\n";
  }
  if (!node.more_parameters.empty()) {
    text += "\nParameters of the environments and of their cameras; each environment has some:\n ";
    for (const std::string& name : node.more_parameters) text += " " + name;
    text += '\n';
  }
  return text +
         "\nNAME:=NAME remaps a topic or a service. Documentation: docs/ros_interface.md and "
         "docs/ros_guide.md,\nhttps://github.com/walker-sim/walker_sim\n";
}

void check_arguments(const std::vector<std::string>& arguments, const NodeDescription& node) {
  const bool is_by_roslaunch =
      std::any_of(arguments.begin(), arguments.end(),
                  [](const std::string& argument) { return argument.rfind("__log:=", 0) == 0; });
  for (const std::string& argument : arguments) {
    const std::size_t assignment = argument.find(kAssignment);
    if (assignment == std::string::npos) refuse_word(argument, node);
    const std::string name = argument.substr(0, assignment);
    const std::string value = argument.substr(assignment + 2);
    if (name == "__name" || name == "__ns") check_name(argument, value);
    if (argument == "__name:=") refuse(argument, "is not a valid name: it is empty");
    if (name.rfind('_', 0) == 0) continue;  // a special key, or a parameter, checked by its reader
    const std::string beginning = probable_beginning(bare_name(name), node);
    std::string error;
    if (!beginning.empty() && !(is_by_roslaunch && ros::names::validate(value, error))) {
      std::string text = "remaps a topic or a service, but this node has none that is called ";
      text.append(name).append("; did you mean ").append(beginning).append(value).append("?");
      refuse(argument, text);
    }
    check_name(argument, name);
    check_name(argument, value);
  }
}

}  // namespace walker
