// The state of an episode as rviz markers.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <deque>
#include <optional>

#include <geometry_msgs/Point.h>
#include <std_msgs/Header.h>
#include <visualization_msgs/Marker.h>
#include <visualization_msgs/MarkerArray.h>

#include "episode/episode.h"
#include "walker_sim/sensors.h"
#include "walker_sim/specification.h"

namespace walker {

/// The range finder's rays, the feet's contacts and a text about the episode.
/// @param header odometry frame and stamp
visualization_msgs::MarkerArray state_markers(const Specification& specification,
                                              const Sensors& sensors, const EpisodeState& state,
                                              const std_msgs::Header& header);

/// Lowest point of the link's shapes in the world; none if the link has no shape.
/// @param y    centre of its prisms in y, in the link's frame [m]
/// @param pose of the link in the world
std::optional<Eigen::Vector3d> lowest_point(const Link& link, double y, const Pose& pose);

/// Path of the trunk through an episode: its latest points, each kSpacing or more from the last.
class Path {
 public:
  static constexpr double kSpacing = 0.1;         ///< minimum distance between points [m]
  static constexpr std::size_t kMaxPoints = 400;  ///< older ones are dropped

  /// Adds the point if it is the first, or far enough from the latest.
  /// @param trunk position in the world [m]; ignored if non-finite
  /// @return whether the path has changed
  bool add(const Vector3& trunk);

  void clear() { points_.clear(); }

  /// A line; with fewer than two points, a marker that deletes it.
  /// @param header odometry frame and stamp
  visualization_msgs::Marker marker(const std_msgs::Header& header) const;

 private:
  std::deque<geometry_msgs::Point> points_;
};

}  // namespace walker
