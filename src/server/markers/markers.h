// rviz markers of an episode's scene and state, and their topics.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <deque>
#include <optional>
#include <string>

#include <geometry_msgs/Point.h>
#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <std_msgs/ColorRGBA.h>
#include <std_msgs/Header.h>
#include <visualization_msgs/Marker.h>
#include <visualization_msgs/MarkerArray.h>

#include "episode/walker.h"
#include "walker_sim/sensors.h"
#include "walker_sim/specification.h"

namespace walker {

using std_msgs::Header;
using visualization_msgs::Marker;
using visualization_msgs::MarkerArray;

// Every `header` has the odometry frame and the stamp.

/// A marker with all fields that rviz requires, at the identity pose.
/// @param scale width of lines, diameter of spheres or height of text [m]; 1: triangles
/// @param color of what has no colour of its own
Marker make_marker(const Header& header, const char* name, int type, double scale = 1,
                   const Color& color = {1, 1, 1, 1});

/// A marker that deletes the marker of this name.
Marker deletion(const Header& header, const char* name);

std_msgs::ColorRGBA to_color(const Color& color);

/// Terrain, obstacles, clouds and flags, after a marker that deletes those of the previous episode.
/// They change only at a reset. The floor is a separate marker because it follows the walker.
MarkerArray scene_markers(const Scene& scene, const Header& header);

/// Centre of the drawn floor for a walker at `x` [m]: `x` rounded to four tiles to change seldom.
double floor_center(const Floor& floor, double x);

/// Tiles of a floor around `center`, paler with distance. The pattern is fixed in the world.
/// @param center as `floor_center` returns it
Marker floor_marker(const Floor& floor, double center, const Header& header);

/// The range finder's rays, the feet's contacts and a text about the episode.
MarkerArray state_markers(const Specification& specification, const Sensors& sensors,
                          const EpisodeState& state, const Header& header);

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
  Marker marker(const Header& header) const;

 private:
  std::deque<geometry_msgs::Point> points_;
};

/// Publishes `scene_markers` and `state_markers` of one environment. Without subscribers nothing is
/// measured or built; a new one receives the present markers at once, as if latched.
class MarkerTopics {
 public:
  /// @param frame odometry frame
  MarkerTopics(ros::NodeHandle& node, Walker& shown, std::string frame);
  MarkerTopics(const MarkerTopics&) = delete;
  MarkerTopics& operator=(const MarkerTopics&) = delete;
  ~MarkerTopics() = default;

  /// Publishes the scene of a new episode. `publish_state` must follow.
  void begin_episode(ros::Time stamp);

  /// Publishes the present state. The simulation must not have failed.
  void publish_state(ros::Time stamp);

 private:
  bool has_state() const { return shown_.state().has_begun() && shown_.state().error.empty(); }
  double floor_center();
  MarkerArray make_scene();
  MarkerArray make_state();
  void move_floor();
  Header header() const;

  Walker& shown_;
  std::string frame_;
  ros::Publisher scene_publisher_;
  ros::Publisher state_publisher_;
  ros::Time stamp_;  // of the present state

  std::optional<Floor> floor_;  // of this episode, once its scene has been made
  double floor_center_ = 0;     // x of the part that is drawn
  Path path_;                   // since state_markers has subscribers
};

}  // namespace walker
