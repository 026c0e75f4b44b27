// Outputs of a state: topics, markers, pictures, and the transition in a response.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <ros/single_subscriber_publisher.h>
#include <std_msgs/Float64.h>
#include <std_msgs/Float64MultiArray.h>

#include "server/camera/camera.h"
#include "server/environments.h"
#include "server/markers/marker_topics.h"
#include "server/parameter_reader.h"
#include "server/topics/converters.h"
#include "walker_sim/EpisodeRecord.h"

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

/// Publishes the states of the shown environment. Topics that are not latched are published only
/// while they have subscribers.
class Outputs {
 public:
  /// @param pool outlives this
  Outputs(ros::NodeHandle& node, Pool& pool, const ServerOptions& options,
          const RenderThread::MakeRenderer& make_renderer);

  /// Publishes the specification and the static transforms (latched).
  void publish_constants(ros::Time stamp);

  /// Publishes the state after a reset, with the episode (latched) and the scene.
  void publish_reset(ros::Time stamp);

  /// Publishes the state after a step, and if the episode has ended, also the episode (latched) and
  /// its record.
  void publish_step(ros::Time stamp);

  /// Returns the record of a running episode that is about to be abandoned; nullopt if no episode
  /// runs or nobody subscribes to records.
  std::optional<walker_sim::EpisodeRecord> abandoned_record(ros::Time stamp) const;
  void publish_abandoned(const std::optional<walker_sim::EpisodeRecord>& record);

  walker_sim::Transition message(const EpisodeState& state, ros::Time stamp) const;
  walker_sim::EnvironmentSpec spec() const;
  /// @param record of the present episode
  walker_sim::EpisodeRecord message(EpisodeRecord record, ros::Time stamp) const;

  ServerCamera& camera() { return camera_; }
  const ServerCamera& camera() const { return camera_; }
  const RecorderWatch& recorder_watch() const { return recorder_watch_; }

 private:
  /// A publisher and its message, which keeps its capacity between publications.
  template <typename Message>
  struct Topic {
    bool is_heard() const { return publisher && publisher.getNumSubscribers() > 0; }
    void publish() const { publisher.publish(message); }
    template <typename... Arguments>
    void publish_if_heard(const Arguments&... arguments) {
      if (!is_heard()) return;
      to_message(arguments..., message);
      publish();
    }

    ros::Publisher publisher;
    Message message;
  };

  void publish_state(ros::Time stamp);
  void publish_sensors(ros::Time stamp);
  void publish_episode(ros::Time stamp);
  void publish_record(ros::Time stamp);
  walker_sim::EpisodeRecord record(ros::Time stamp) const;

  Episode& shown_;
  ServerOptions options_;
  Frames frames_;
  RecorderWatch recorder_watch_;  // of the topic needed to replay a bag

  Topic<sensor_msgs::JointState> joint_states_;
  Topic<sensor_msgs::LaserScan> scan_;
  Topic<sensor_msgs::Imu> imu_;
  Topic<walker_sim::Contacts> contacts_;
  Topic<nav_msgs::Odometry> odometry_;
  Topic<std_msgs::Float64> reward_;
  Topic<std_msgs::Float64MultiArray> observation_;
  Topic<walker_sim::Transition> transition_;
  Topic<walker_sim::Episode> episode_;
  Topic<tf2_msgs::TFMessage> transforms_;
  ros::Publisher record_publisher_;
  ros::Publisher spec_publisher_;
  ros::Publisher static_transforms_publisher_;
  MarkerTopics markers_;
  ServerCamera camera_;
};

}  // namespace walker
