// A node's command line: validation before ROS parses it, and --help.
#pragma once

#include <string>
#include <vector>

#include "walker_sim/parameters.h"

namespace walker {

struct NodeDescription {
  std::string program;  ///< executable's name for rosrun
  std::string name;     ///< node name, unless __name:= sets another
  std::string summary;
  std::vector<ParameterDescription> parameters;
  std::vector<std::string> more_parameters;  ///< names that --help lists without a description
};

/// Returns the text of --help, which ends with a newline.
std::string help_text(const NodeDescription& node);

/// Validates the arguments, without the program's name: ROS ignores some malformed ones and aborts
/// on others.
/// @throws std::invalid_argument for an argument that is not NAME:=VALUE, an invalid name, or a
///         remapping of a parameter's or a special key's name, with a suggestion. From roslaunch a
///         valid remapping is accepted, since those of a launch file apply to many nodes
void check_arguments(const std::vector<std::string>& arguments, const NodeDescription& node);

}  // namespace walker
