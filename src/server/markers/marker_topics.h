// The topics of rviz markers, published only while they have subscribers.
#pragma once

#include <optional>
#include <string>

#include <ros/node_handle.h>
#include <ros/publisher.h>

#include "episode/episode.h"
#include "server/markers/markers.h"

namespace walker {

/// Publishes `scene_markers` and `state_markers` of one environment. Without subscribers nothing is
/// measured or built; a new one receives the present markers at once, as if latched.
class MarkerTopics {
 public:
  /// @param frame odometry frame
  MarkerTopics(ros::NodeHandle& node, Episode& shown, std::string frame);
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
  visualization_msgs::MarkerArray make_scene();
  visualization_msgs::MarkerArray make_state();
  void move_floor();
  std_msgs::Header header() const;

  Episode& shown_;
  std::string frame_;
  ros::Publisher scene_publisher_;
  ros::Publisher state_publisher_;
  ros::Time stamp_;  // of the present state

  std::optional<Floor> floor_;  // of this episode, once its scene has been made
  double floor_center_ = 0;     // x of the part that is drawn
  Path path_;                   // since state_markers has subscribers
};

}  // namespace walker
