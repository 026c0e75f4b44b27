// rviz markers of an episode's scene and state, made from their drawings, and their topics.
#pragma once

#include <optional>
#include <string>

#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <std_msgs/Header.h>
#include <visualization_msgs/Marker.h>
#include <visualization_msgs/MarkerArray.h>

#include "drawing/drawing.h"
#include "episode/walker.h"
#include "walker_sim/sensors.h"
#include "walker_sim/specification.h"

namespace walker {

using std_msgs::Header;
using visualization_msgs::Marker;
using visualization_msgs::MarkerArray;

// Every `header` has the odometry frame and the stamp.

/// Returns the marker of a drawing, whose namespace is the drawing's name. A drawing without points
/// becomes a marker that deletes the one of this name.
Marker to_marker(const Drawing& drawing, const Header& header);

/// Returns the scene's drawings after a marker that deletes those of the previous episode.
MarkerArray scene_markers(const Scene& scene, const Header& header);

/// Returns the state's drawings, with a text about the episode.
MarkerArray state_markers(const Specification& specification, const Sensors& sensors,
                          const EpisodeState& state, const Header& header);

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
