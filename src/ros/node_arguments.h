// Description of a node, and its command line: valid arguments and the text of --help.
#pragma once

#include <string>
#include <vector>

#include "walker_sim/parameters.h"

namespace walker {

struct NodeDescription {
  std::string program;  ///< executable's name for rosrun
  std::string name;     ///< node name, unless __name:= sets another
  std::string summary;
  // GCC warns about a node without parameters unless there are initializers.
  std::vector<ParameterDescription> parameters = {};  // NOLINT(readability-redundant-member-init)
  /// Names that --help lists without a description.
  std::vector<std::string> more_parameters = {};  // NOLINT(readability-redundant-member-init)
  /// Returns whether roscpp subscribes to /clock under /use_sim_time; null: never. Each message of
  /// /clock wakes two threads of a node, so a node that publishes it, or that receives stamps
  /// anyway, calls `set_time` instead. Called after ros::init.
  bool (*follows_clock)() = nullptr;
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
