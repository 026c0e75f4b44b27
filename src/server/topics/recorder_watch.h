// Checks that a recorder subscribes to the topics that it must record.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>

#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <ros/single_subscriber_publisher.h>

namespace walker {

/// Advertises topics and tracks whether one node, the recorder, subscribes to them. `rosbag record`
/// connects to one topic after another, in any order, and misses messages published before.
class RecorderWatch {
 public:
  /// @param recorder full name of the node; empty: none
  explicit RecorderWatch(std::string recorder) : recorder_(std::move(recorder)) {}
  RecorderWatch(const RecorderWatch&) = delete;  // callbacks of publishers point to it
  RecorderWatch& operator=(const RecorderWatch&) = delete;
  ~RecorderWatch() = default;

  /// Advertises a topic to which the recorder must subscribe.
  /// @param node whose callback queue reports subscribers that connect and disconnect
  template <typename Message>
  ros::Publisher advertise(ros::NodeHandle& node, const std::string& topic,
                           std::uint32_t queue_size, bool is_latched) {
    int& connections = connections_[topic];
    const auto count = [this, &connections](const ros::SingleSubscriberPublisher& listener,
                                            int change) {
      if (listener.getSubscriberName() == recorder_) connections += change;
    };
    return node.advertise<Message>(
        topic, queue_size, [count](const auto& listener) { count(listener, 1); },
        [count](const auto& listener) { count(listener, -1); }, ros::VoidConstPtr(), is_latched);
  }

  /// The topics without the recorder, e.g. "/recorder does not listen to episode, spec (parameter
  /// wait_for_recorder)"; empty if there are none, or no recorder is expected.
  std::string complaint() const {
    if (recorder_.empty()) return "";
    std::string missing;
    for (const auto& [topic, connections] : connections_) {
      if (connections == 0) missing += (missing.empty() ? "" : ", ") + topic;
    }
    if (missing.empty()) return "";
    return recorder_ + " does not listen to " + missing + " (parameter wait_for_recorder)";
  }

 private:
  std::string recorder_;
  std::map<std::string, int> connections_;  // of the recorder, by topic
};

}  // namespace walker
