// What a server's environment is, as far as an agent must know.
#pragma once

#include <optional>
#include <string>

#include <ros/node_handle.h>

#include "walker_sim/specification.h"

namespace walker {

/// Waits for `<server>/get_spec`, however long, and asks it.
/// @return the specification of the same environment made here; none when told to stop
/// @throws std::invalid_argument when it cannot be made here: this package does not know it, or its
///         model file is on the server's machine only; or when the server has several
std::optional<Specification> ask_specification(ros::NodeHandle& node, const std::string& server);

}  // namespace walker
