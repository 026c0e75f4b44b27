// rviz markers of an episode's scene and state.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <deque>
#include <optional>

#include <geometry_msgs/Point.h>
#include <std_msgs/ColorRGBA.h>
#include <std_msgs/Header.h>
#include <visualization_msgs/Marker.h>
#include <visualization_msgs/MarkerArray.h>

#include "episode/episode.h"
#include "walker_sim/sensors.h"
#include "walker_sim/specification.h"

namespace walker {

// Every `header` has the odometry frame and the stamp.

/// A marker with all fields that rviz requires: identity pose, unit scale, opaque white.
visualization_msgs::Marker make_marker(const std_msgs::Header& header, const char* name, int type);

/// A marker that deletes the marker of this name.
visualization_msgs::Marker deletion(const std_msgs::Header& header, const char* name);

std_msgs::ColorRGBA to_color(const Color& color);

/// Terrain, obstacles, clouds and flags, after a marker that deletes those of the previous episode.
/// They change only at a reset. The floor is a separate marker because it follows the walker.
visualization_msgs::MarkerArray scene_markers(const Scene& scene, const std_msgs::Header& header);

/// Centre of the drawn floor for a walker at `x` [m]: `x` rounded to four tiles to change seldom.
double floor_center(const Floor& floor, double x);

/// Tiles of a floor around `center`, paler with distance. The pattern is fixed in the world.
/// @param center as `floor_center` returns it
visualization_msgs::Marker floor_marker(const Floor& floor, double center,
                                        const std_msgs::Header& header);

/// The range finder's rays, the feet's contacts and a text about the episode.
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
  visualization_msgs::Marker marker(const std_msgs::Header& header) const;

 private:
  std::deque<geometry_msgs::Point> points_;
};

}  // namespace walker
