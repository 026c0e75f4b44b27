// Outputs of a state: topics, markers, pictures, and the transition in a response.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <ros/callback_queue.h>
#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <ros/single_subscriber_publisher.h>
#include <std_msgs/Float64.h>
#include <std_msgs/Float64MultiArray.h>

#include "server/camera/camera.h"
#include "server/environments.h"
#include "server/markers/markers.h"
#include "server/parameter_reader.h"
#include "server/topics/converters.h"
#include "walker_sim/EpisodeRecord.h"

namespace walker {

/// Publishes the states of the shown environment. Topics that are not latched are published only
/// while they have subscribers.
class Outputs {
 public:
  /// @param pool outlives this
  Outputs(ros::NodeHandle& node, Pool& pool, const ServerOptions& options,
          const RenderThread::MakeRenderer& make_renderer);

  /// Publishes the specification and the static transforms (latched).
  void publish_constants(ros::Time stamp);
  /// Publishes the specification (latched) with the world of the resets to come.
  void publish_spec();

  /// Publishes the state after a reset, with the episode (latched) and the scene.
  void publish_reset(ros::Time stamp);

  /// Publishes the state after a step, and if the episode has ended, also the episode (latched) and
  /// its record.
  void publish_step(ros::Time stamp);

  /// While nothing moves, publishes the present transforms and joint states to subscribers that
  /// have connected since the last step. While steps follow each other, the next step's messages
  /// serve them.
  void serve_late_subscribers();

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
  /// "/recorder does not listen to episode_record (parameter wait_for_recorder)"; empty if it does,
  /// or no recorder is expected.
  std::string recorder_complaint() const;

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

  template <typename Message>
  ros::Publisher advertise_state(ros::NodeHandle& node, const char* topic, std::uint32_t queue_size,
                                 void (Outputs::*send)(const ros::SingleSubscriberPublisher&));
  void send_transforms(const ros::SingleSubscriberPublisher& subscriber);
  void send_joint_states(const ros::SingleSubscriberPublisher& subscriber);
  void publish_state(ros::Time stamp);
  void publish_measurements();
  bool has_state() const;
  std::optional<ros::Time> measured_at() const;
  void publish_episode(ros::Time stamp);
  ros::Publisher advertise_records(ros::NodeHandle& node);
  void publish_record(ros::Time stamp);
  walker_sim::EpisodeRecord record(ros::Time stamp) const;

  Episode& shown_;
  ServerOptions options_;
  Frames frames_;
  int recorder_connections_ = 0;   // to the topic that is needed to replay a bag
  std::vector<ros::Time> stamps_;  // ring by step: as many as the world's observation delay needs
  std::uint32_t first_stamp_ = 0;  // step of the first one; 0 unless the episode was restored
  std::optional<std::uint32_t> observed_step_;  // of the newest measurements; none: no state yet
  ros::CallbackQueue late_subscribers_;         // connected since the last publication
  std::chrono::steady_clock::time_point published_at_;

  Topic<sensor_msgs::JointState> joint_states_;
  Topic<sensor_msgs::LaserScan> scan_;
  Topic<sensor_msgs::Imu> imu_;
  Topic<walker_sim::Contacts> contacts_;
  Topic<nav_msgs::Odometry> odometry_;
  Topic<std_msgs::Float64> reward_;
  Topic<std_msgs::Float64MultiArray> observation_;
  Topic<walker_sim::Transition> transition_;
  Topic<tf2_msgs::TFMessage> transforms_;
  ros::Publisher episode_publisher_;
  ros::Publisher record_publisher_;
  ros::Publisher spec_publisher_;
  ros::Publisher static_transforms_publisher_;
  MarkerTopics markers_;
  ServerCamera camera_;
};

}  // namespace walker
