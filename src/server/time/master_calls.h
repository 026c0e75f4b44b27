// Calls of the ROS master that come to an end.
#pragma once

#include <chrono>
#include <string>

namespace walker {

/// Makes a call, in place of ros::master::execute, which waits for ever where a master hangs: one
/// that is stopped, or a machine that is lost.
/// @param uri     of the master
/// @param call    an XML-RPC text
/// @param longest to wait for the answer; a host's name is looked up in the time that it takes
/// @throws std::exception that says why there is no answer, or what the master refuses
void call_master(const std::string& uri, const std::string& call,
                 std::chrono::steady_clock::duration longest);

}  // namespace walker
