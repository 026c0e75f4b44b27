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

/// The range finder's rays, the feet's contacts and a text of the episode, for every state.
/// @param header odometry frame and stamp
visualization_msgs::MarkerArray state_markers(const Specification& specification,
                                              const Sensors& sensors, const EpisodeState& state,
                                              const std_msgs::Header& header);

/// The point of the link's shapes that lies lowest in the world, where the link has a shape.
/// @param y    where its prisms stand in the link's frame, of which this is the middle [m]
/// @param pose of the link in the world
std::optional<Eigen::Vector3d> lowest_point(const Link& link, double y, const Pose& pose);

/// The way of the trunk through an episode: its newest points, each some way from the one before.
class Path {
 public:
  static constexpr double kSpacing = 0.1;         ///< between points, at least [m]
  static constexpr std::size_t kMaxPoints = 400;  ///< older ones are forgotten

  /// Takes the point if it is the first, or far enough from the newest.
  /// @param trunk position in the world [m]; one that is not finite is left out
  /// @return whether the path has changed
  bool add(const Vector3& trunk);

  void clear() { points_.clear(); }

  /// A line; where there are not two points yet, one that takes back the line before.
  /// @param header odometry frame and stamp
  visualization_msgs::Marker marker(const std_msgs::Header& header) const;

 private:
  std::deque<geometry_msgs::Point> points_;
};

}  // namespace walker
