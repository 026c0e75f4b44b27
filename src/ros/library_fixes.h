// Replacements for functions of roscpp's libraries that can terminate the process or listen on more
// addresses than ROS_HOSTNAME says. The package itself calls none of those: each node logs its
// `listening_addresses`, which makes the linker include them.
#pragma once

#include <string>

namespace walker {

/// Returns a sentence for the log: where this node listens, and which variable determines that. If
/// ROS_HOSTNAME or ROS_IP is localhost, ::1 or 127.*, that is the loopback interface only, as in
/// rospy. If neither is set, ROS uses the machine's host name, and a node listens on every address.
std::string listening_addresses();

}  // namespace walker
