// Keeps the messages of a topic so that a test can wait for one of them.
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <ros/node_handle.h>
#include <ros/subscriber.h>
#include <ros/time.h>
#include <ros/transport_hints.h>
#include <tf2_msgs/TFMessage.h>

namespace walker::test {

constexpr std::chrono::seconds kPatience{30};  // reached only by a failing test

/// Polls until the condition holds. @return false after kPatience
template <typename Condition>
bool wait_until(const Condition& condition) {
  const auto give_up = std::chrono::steady_clock::now() + kPatience;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > give_up) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return true;
}

template <typename Message>
ros::Time stamp_of(const Message& message) {
  return message.header.stamp;
}

inline ros::Time stamp_of(const tf2_msgs::TFMessage& message) {
  return message.transforms.empty() ? ros::Time() : message.transforms.front().header.stamp;
}

/// Subscribes to a topic and keeps all messages. Another thread must spin. All timeouts are wall
/// time.
template <typename Message>
class Inbox {
 public:
  Inbox(ros::NodeHandle& node, const std::string& topic)
      : topic_(topic),
        subscriber_(node.subscribe<Message>(
            topic, 100000, [this](const typename Message::ConstPtr& message) { add(*message); },
            ros::VoidConstPtr(), ros::TransportHints().tcpNoDelay())) {
    wait_until([this] { return subscriber_.getNumPublishers() > 0; });
  }

  /// The first message, old or new, that meets the condition; nullopt after a timeout.
  std::optional<Message> find(const std::function<bool(const Message&)>& condition) {
    const auto give_up = std::chrono::steady_clock::now() + kPatience;
    std::unique_lock<std::mutex> lock(mutex_);
    std::size_t examined = 0;
    for (;;) {
      for (; examined < messages_.size(); ++examined) {
        if (condition(messages_[examined])) return messages_[examined];
      }
      if (changed_.wait_until(lock, give_up) == std::cv_status::timeout) return std::nullopt;
    }
  }

  std::optional<Message> at(ros::Time stamp) {
    return find([stamp](const Message& message) { return stamp_of(message) == stamp; });
  }

  bool has_any() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return !messages_.empty();
  }

  std::vector<Message> messages() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return messages_;
  }

 private:
  void add(const Message& message) {
    const std::lock_guard<std::mutex> lock(mutex_);
    messages_.push_back(message);
    changed_.notify_all();
  }

  std::string topic_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<Message> messages_;
  ros::Subscriber subscriber_;  // last: its callbacks use the members above
};

}  // namespace walker::test
