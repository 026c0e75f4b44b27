// The surroundings of an episode as rviz markers.
#pragma once

#include <std_msgs/Header.h>
#include <visualization_msgs/Marker.h>
#include <visualization_msgs/MarkerArray.h>

#include "walker_sim/sensors.h"

namespace walker {

/// Terrain, obstacles, clouds and flags, first of all a marker that deletes those of the episode
/// before. Changes only at a reset. The floor is a marker apart, for it goes along.
/// @param header odometry frame and stamp
visualization_msgs::MarkerArray scene_markers(const Scene& scene, const std_msgs::Header& header);

/// Where the part of the floor lies that is drawn for a walker at `x`: some way off at most, and
/// the same for many x, so that few parts are drawn [m].
double floor_center(const Floor& floor, double x);

/// The tiles of a floor around `center`, paler towards the far ones. Tiles keep their place in the
/// world wherever the centre is.
/// @param center as `floor_center` gives it
/// @param header odometry frame and stamp
visualization_msgs::Marker floor_marker(const Floor& floor, double center,
                                        const std_msgs::Header& header);

}  // namespace walker
