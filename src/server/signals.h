// How a node is told to end.
#pragma once

#include <csignal>

#include <ros/init.h>

namespace walker {

/// Ends the node on SIGTERM as roscpp does on SIGINT: with its services and topics taken off the
/// master. Call it after `ros::init`.
inline void end_on_sigterm() {
  std::signal(SIGTERM, [](int /*signal*/) { ros::requestShutdown(); });  // sets a flag
}

}  // namespace walker
