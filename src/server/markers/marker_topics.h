// The topics that rviz draws from, published only while somebody looks.
#pragma once

#include <optional>
#include <string>

#include <ros/node_handle.h>
#include <ros/publisher.h>

#include "episode/episode.h"
#include "server/markers/state_markers.h"

namespace walker {

/// Publishes `scene_markers` and `state_markers` of one environment. While nobody subscribes,
/// nothing is measured and nothing is built; who comes then gets what is to be seen at once, as if
/// the topics were latched.
class MarkerTopics {
 public:
  /// @param frame odometry frame
  MarkerTopics(ros::NodeHandle& node, Episode& shown, std::string frame);
  MarkerTopics(const MarkerTopics&) = delete;
  MarkerTopics& operator=(const MarkerTopics&) = delete;
  ~MarkerTopics() = default;

  /// The scene of a new episode. Its state is to follow.
  void begin_episode(ros::Time stamp);

  /// The present state. Needs an episode whose simulation has not failed.
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
  double floor_center_ = 0;     // of the part that is drawn
  Path path_;                   // since somebody looks
};

}  // namespace walker
