// A node's command line: what is refused before ROS reads it, and --help.
#pragma once

#include <string>
#include <vector>

#include "walker_sim/parameters.h"

namespace walker {

/// What a node is called and takes.
struct NodeDescription {
  std::string program;  ///< as rosrun calls it
  std::string name;     ///< unless __name:= gives another
  std::string summary;
  std::vector<ParameterDescription> parameters;
  std::vector<std::string> more_parameters;  ///< names of those that --help does not describe
};

/// The text of --help, with its last line's end.
std::string help_text(const NodeDescription& node);

/// Checks the arguments, without the program's name, of which ROS ignores some and aborts on
/// others.
/// @throws std::invalid_argument for an argument that is not NAME:=VALUE, for an invalid name, and
///         for a remapping of a parameter's name, with what was probably meant. The last is
///         accepted from roslaunch if it is valid, for a launch file's remappings are meant for
///         many nodes
void check_arguments(const std::vector<std::string>& arguments, const NodeDescription& node);

}  // namespace walker
