#include <cmath>
#include <utility>
#include <vector>

#include <ros/single_subscriber_publisher.h>

#include "server/markers/markers.h"

namespace walker {
namespace {

// Viewers that are briefly slow must not miss a scene, the floors that follow it, or the path,
// which only some of the state messages contain.
constexpr std::uint32_t kSceneQueue = 20;
constexpr std::uint32_t kStateQueue = 5;

}  // namespace

MarkerTopics::MarkerTopics(ros::NodeHandle& node, Walker& shown, std::string frame)
    : shown_(shown), frame_(std::move(frame)) {
  scene_publisher_ = node.advertise<MarkerArray>(
      "scene_markers", kSceneQueue, [this](const ros::SingleSubscriberPublisher& viewer) {
        if (has_state()) viewer.publish(make_scene());
      });
  state_publisher_ = node.advertise<MarkerArray>(
      "state_markers", kStateQueue, [this](const ros::SingleSubscriberPublisher& viewer) {
        if (!has_state()) return;
        MarkerArray array = make_state();
        array.markers.push_back(to_marker(path_.drawing(), header()));
        viewer.publish(array);
      });
}

void MarkerTopics::begin_episode(ros::Time stamp) {
  stamp_ = stamp;
  path_.clear();
  floor_.reset();
  if (scene_publisher_.getNumSubscribers() > 0) scene_publisher_.publish(make_scene());
}

void MarkerTopics::publish_state(ros::Time stamp) {
  stamp_ = stamp;
  if (scene_publisher_.getNumSubscribers() > 0) move_floor();
  if (state_publisher_.getNumSubscribers() == 0) {
    path_.clear();
    return;
  }
  MarkerArray array = make_state();
  const std::vector<Pose>& links = shown_.sensors().link_poses;
  if (!links.empty() && path_.add(links.front().position))
    array.markers.push_back(to_marker(path_.drawing(), header()));
  state_publisher_.publish(array);
}

MarkerArray MarkerTopics::make_scene() {
  const Scene& scene = shown_.scene();
  MarkerArray array = scene_markers(scene, header());
  floor_ = scene.floor;
  if (floor_) {
    floor_center_ = floor_center();
    array.markers.push_back(to_marker(floor_drawing(*floor_, floor_center_), header()));
  }
  return array;
}

MarkerArray MarkerTopics::make_state() {
  return state_markers(shown_.specification(), shown_.sensors(), shown_.state(), header());
}

void MarkerTopics::move_floor() {
  if (!floor_) return;
  const double center = floor_center();
  if (center == floor_center_) return;
  floor_center_ = center;
  MarkerArray array;
  array.markers.push_back(to_marker(floor_drawing(*floor_, floor_center_), header()));
  scene_publisher_.publish(array);
}

double MarkerTopics::floor_center() {
  const std::vector<Pose>& links = shown_.sensors().link_poses;
  const double x = links.empty() ? 0 : links.front().position[0];
  return std::isfinite(x) ? walker::floor_center(*floor_, x) : floor_center_;
}

Header MarkerTopics::header() const {
  Header header;
  header.stamp = stamp_;
  header.frame_id = frame_;
  return header;
}

}  // namespace walker
