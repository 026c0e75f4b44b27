// Whether a node that records listens to what it has to.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>

#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <ros/single_subscriber_publisher.h>

namespace walker {

/// Advertises topics and watches whether one node, the recorder, listens to them. `rosbag record`
/// connects to one after the other, in any order, and what is published before is not in its bag.
class RecorderWatch {
 public:
  /// @param recorder full name of the node; empty: nobody records
  explicit RecorderWatch(std::string recorder) : recorder_(std::move(recorder)) {}
  RecorderWatch(const RecorderWatch&) = delete;  // callbacks of publishers point to it
  RecorderWatch& operator=(const RecorderWatch&) = delete;
  ~RecorderWatch() = default;

  /// Advertises a topic to which the recorder has to listen.
  /// @param node whose callbacks tell of listeners that come and go
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

  /// What the recorder does not listen to, e.g. "/recorder does not listen to episode, spec
  /// (parameter wait_for_recorder)"; empty: nothing, or there is none.
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
