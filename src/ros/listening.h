#pragma once

#include <string>

namespace walker {

/// Returns whether ROS_HOSTNAME or ROS_IP restricts this node to the loopback interface: localhost,
/// ::1 or 127.*, as in roscpp's `Transport` and rospy's `get_bind_address`. If neither is set, ROS
/// uses the machine's host name, and a node listens on every address.
bool is_loopback_only();

/// Returns a sentence for the log: where this node listens, and which variable determines that.
std::string listening_addresses();

}  // namespace walker
