// Calls of the ROS master that come to an end.
#pragma once

#include <chrono>
#include <string>

#include "client/xml_rpc.h"

namespace walker {

/// Makes a call of a master or, with the same form of answers, of a node: in place of
/// ros::master::execute, which waits for ever where a master hangs: one that is stopped, or a
/// machine that is lost.
/// @param uri     of whom is called
/// @param call    an XML-RPC text
/// @param longest to wait for the answer; a host's name is looked up in the time that it takes
/// @return what comes with its success
/// @throws std::exception that says why there is no answer, or what is refused
xml_rpc::Value call_master(const std::string& uri, const std::string& call,
                           std::chrono::steady_clock::duration longest);

}  // namespace walker
