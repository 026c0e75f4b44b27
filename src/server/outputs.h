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

#include "server/batch_calls.h"
#include "server/camera/camera.h"
#include "server/markers/markers.h"
#include "server/parameter_reader.h"
#include "server/time/simulation_clock.h"
#include "server/topics/converters.h"
#include "server/topics/topic_pace.h"
#include "walker_sim/EpisodeRecord.h"

namespace walker {

/// Publishes the states of the shown environment, stamped with the clock's present time, which is
/// published first. Topics that are not latched are published only while they have subscribers.
///
/// Transitions, episodes and records are all published. The other topics show the newest state, in
/// lock-step at the pace of `max_topic_rate`.
class Outputs {
 public:
  /// @param pool, clock outlive this
  Outputs(ros::NodeHandle& node, Pool& pool, SimulationClock& clock, const ServerOptions& options,
          const RenderThread::MakeRenderer& make_renderer);

  /// Publishes the specification and the static transforms (latched).
  void publish_constants();
  /// Publishes the specification (latched) with the world of the resets to come.
  void publish_spec();

  /// Publishes the state after a reset or a call that sets it, with the episode (latched) and the
  /// scene.
  void publish_reset();

  /// Publishes the state after a step, and if the episode has ended, also the episode (latched) and
  /// its record.
  void publish_step();

  /// Shows the newest state if the pace has held it back and no other has followed for 1 ms. While
  /// nothing moves, also publishes the present transforms and joint states to subscribers that have
  /// connected since the last state. While states follow each other, the next state's messages
  /// serve them.
  void catch_up();
  /// Upper bound of the wait before the next `catch_up`.
  std::chrono::steady_clock::duration longest_wait() const;

  /// Returns the record of a running episode that is about to be abandoned; nullopt if no episode
  /// runs or nobody subscribes to records.
  std::optional<walker_sim::EpisodeRecord> abandoned_record() const;
  void publish_abandoned(const std::optional<walker_sim::EpisodeRecord>& record);

  walker_sim::Transition message(const EpisodeState& state) const;
  walker_sim::EnvironmentSpec spec() const;
  /// @param record of the present episode
  walker_sim::EpisodeRecord message(EpisodeRecord record) const;

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
  void publish_state();
  void show(std::chrono::steady_clock::time_point now);
  void publish_measurements();
  bool is_any_sensor_heard() const;
  bool has_state() const;
  std::optional<ros::Time> measured_at() const;
  void publish_episode();
  void publish_picture();
  ros::Publisher advertise_records(ros::NodeHandle& node);
  void publish_record();
  walker_sim::EpisodeRecord record() const;

  Walker& shown_;
  SimulationClock& clock_;
  ServerOptions options_;
  Frames frames_;
  int recorder_connections_ = 0;  // to the topic that is needed to replay a bag
  TopicPace pace_;
  ros::Time stamp_;                                   // of the present state
  std::chrono::steady_clock::time_point reached_at_;  // when the present state was reached
  bool is_behind_ = false;         // the topics do not show the present state yet
  bool is_scene_new_ = false;      // the topics do not show the present episode's scene yet
  std::vector<ros::Time> stamps_;  // ring by step: as many as the world's observation delay needs
  std::uint32_t first_stamp_ = 0;  // step of the first one; 0 unless the episode was restored
  std::optional<std::uint32_t> observed_step_;   // of the newest measurements; none: no state yet
  std::optional<ros::Time> observed_at_;         // their stamp; none: before the first one
  std::optional<std::uint32_t> published_step_;  // of the last measurements that were published
  ros::CallbackQueue late_subscribers_;          // connected since the last state was shown
  std::chrono::steady_clock::time_point shown_at_;

  Topic<sensor_msgs::JointState> joint_states_;
  Topic<sensor_msgs::LaserScan> scan_;
  Topic<sensor_msgs::Imu> imu_;
  Topic<walker_sim::Contacts> contacts_;
  Topic<nav_msgs::Odometry> odometry_;
  Topic<std_msgs::Float64> reward_;
  Topic<std_msgs::Float64MultiArray> observation_;
  Topic<walker_sim::Transition> transition_;
  Topic<walker_sim::Episode> progress_;
  Topic<tf2_msgs::TFMessage> transforms_;
  ros::Publisher episode_publisher_;
  ros::Publisher record_publisher_;
  ros::Publisher spec_publisher_;
  ros::Publisher static_transforms_publisher_;
  MarkerTopics markers_;
  ServerCamera camera_;
};

}  // namespace walker
