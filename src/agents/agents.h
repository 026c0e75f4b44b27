// The agents that drive a walker over ROS. Each plays the episodes that the options ask for, or
// until the node is told to stop.
#pragma once

#include "agents/options.h"

namespace walker {

/// Drives a lock-step server by ~reset and ~step. A server that goes away is waited for; its
/// interrupted episode does not count.
/// @throws std::invalid_argument when the agent does not fit the server; std::runtime_error with
///         the server's words when it refuses
void drive_by_services(const AgentOptions& options);

/// Drives a free-running server, or a robot: answers what the sensors measure with an
/// `effort_command` [N m].
///
/// Where episodes begin and end it learns from `episode`; where nobody publishes that, as on a
/// robot, there is one without end. With seeds it begins each episode itself through ~reset;
/// without, the server does.
/// @throws std::invalid_argument when the agent does not fit the environment
void drive_by_topics(const AgentOptions& options);

}  // namespace walker
