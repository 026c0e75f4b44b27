// Pushes by hand: the topic `push`.
#pragma once

#include <geometry_msgs/WrenchStamped.h>

#include "episode/episode.h"
#include "server/topics/converters.h"
#include "walker_sim/sensors.h"

namespace walker {

/// Turns a wrench in the frame of a link, which acts at the frame's origin, into axes of the world.
/// @param sensors of the present state
/// @throws std::invalid_argument naming a frame that is no link, a non-finite value, or a component
///         out of the plane of motion
LinkWrench to_link_wrench(const geometry_msgs::WrenchStamped& message, const Frames& frames,
                          const Sensors& sensors);

}  // namespace walker
