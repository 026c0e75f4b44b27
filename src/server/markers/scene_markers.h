// The surroundings of an episode as rviz markers.
#pragma once

#include <std_msgs/Header.h>
#include <visualization_msgs/Marker.h>
#include <visualization_msgs/MarkerArray.h>

#include "walker_sim/sensors.h"

namespace walker {

/// Terrain, obstacles, clouds and flags, after a marker that deletes those of the previous episode.
/// They change only at a reset. The floor is a separate marker because it follows the walker.
/// @param header odometry frame and stamp
visualization_msgs::MarkerArray scene_markers(const Scene& scene, const std_msgs::Header& header);

/// Centre of the drawn floor for a walker at `x` [m]: `x` rounded to four tiles to change seldom.
double floor_center(const Floor& floor, double x);

/// Tiles of a floor around `center`, paler with distance. The pattern is fixed in the world.
/// @param center as `floor_center` returns it
/// @param header odometry frame and stamp
visualization_msgs::Marker floor_marker(const Floor& floor, double center,
                                        const std_msgs::Header& header);

}  // namespace walker
