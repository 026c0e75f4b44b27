// What the mains of the nodes share.
#pragma once

#include <functional>

#include "ros/node_arguments.h"

namespace walker {

/// Runs a node. --help prints what it takes; arguments that ROS would ignore are refused. Ends the
/// node on SIGINT and on SIGTERM: as roscpp does it, with its services and topics
/// taken off the master. roscpp asks a master for that without a limit of time, so where the master
/// does not answer the process ends without it, with the same status, 0.
/// @param run returns once the node is told to end, or has nothing left to do; what it throws is
///            logged, unless the node was told to end
/// @return the process's exit status
int run_node(int argc, char** argv, const NodeDescription& node, const std::function<void()>& run);

}  // namespace walker
