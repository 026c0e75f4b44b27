// Checks that the recorder subscribes to the topic that it must record.
#pragma once

#include <cstdint>
#include <string>
#include <utility>

#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <ros/single_subscriber_publisher.h>

namespace walker {

/// Advertises a topic and tracks whether one node, the recorder, subscribes to it: `rosbag record`
/// misses messages that are published before it has connected.
class RecorderWatch {
 public:
  /// @param recorder full name of the node; empty: none
  explicit RecorderWatch(std::string recorder) : recorder_(std::move(recorder)) {}
  RecorderWatch(const RecorderWatch&) = delete;  // the publisher's callbacks point to it
  RecorderWatch& operator=(const RecorderWatch&) = delete;
  ~RecorderWatch() = default;

  /// Advertises the topic to which the recorder must subscribe. Call once.
  /// @param node whose callback queue reports subscribers that connect and disconnect
  template <typename Message>
  ros::Publisher advertise(ros::NodeHandle& node, const std::string& topic,
                           std::uint32_t queue_size) {
    topic_ = topic;
    const auto count = [this](const ros::SingleSubscriberPublisher& listener, int change) {
      if (listener.getSubscriberName() == recorder_) connections_ += change;
    };
    return node.advertise<Message>(
        topic, queue_size, [count](const auto& listener) { count(listener, 1); },
        [count](const auto& listener) { count(listener, -1); });
  }

  /// "/recorder does not listen to TOPIC (parameter wait_for_recorder)"; empty if it does, or no
  /// recorder is expected.
  std::string complaint() const {
    if (recorder_.empty() || connections_ > 0) return "";
    return recorder_ + " does not listen to " + topic_ + " (parameter wait_for_recorder)";
  }

 private:
  std::string recorder_;
  std::string topic_;
  int connections_ = 0;  // of the recorder
};

}  // namespace walker
