#pragma once

#include <string>

namespace walker {

/// Whether ROS_HOSTNAME or ROS_IP keep this node on this machine: localhost, ::1 or 127.*, as
/// roscpp's `Transport` and rospy's `get_bind_address` take them. Without them ROS takes the
/// machine's name, and a node listens on every address.
bool listens_here_alone();

/// Where the ports of this node can be reached and what decides it, in a sentence for its log.
std::string listening_addresses();

}  // namespace walker
