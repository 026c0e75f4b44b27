// Common part of the nodes' main functions: the start, signals and the end.
#pragma once

#include <functional>

#include <ros/time.h>

#include "ros/node_arguments.h"

namespace walker {

/// Under /use_sim_time, sets ROS time, e.g. for stamps of the log.
void set_time(ros::Time time);

/// Runs a node. Prints the help text for --help and rejects arguments that ROS would ignore. On
/// SIGINT and SIGTERM the node unregisters its services and topics, as in roscpp, and exits with
/// status 0. roscpp calls the master for that without a timeout, so if the master does not answer,
/// the process exits without unregistering, with the same status.
/// @param run returns when a shutdown is requested or nothing is left to do. Its exception is
///            logged, unless a shutdown was requested
/// @return the process's exit status
int run_node(int argc, char** argv, const NodeDescription& node, const std::function<void()>& run);

}  // namespace walker
