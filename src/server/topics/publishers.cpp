#include "server/topics/publishers.h"

namespace walker {
namespace {

constexpr std::uint32_t kState = 1;     // only the newest state matters
constexpr std::uint32_t kRecord = 100;  // loggers and listeners that want each one
constexpr bool kLatched = true;

bool anybody_listens(const ros::Publisher& publisher) { return publisher.getNumSubscribers() > 0; }

template <typename Message, typename... Arguments>
void publish_if_heard(const ros::Publisher& publisher, Message& message,
                      const Arguments&... arguments) {
  if (!anybody_listens(publisher)) return;
  fill(arguments..., message);
  publisher.publish(message);
}

}  // namespace

Publishers::Publishers(ros::NodeHandle& node, EpisodeRecorder& shown, const ServerOptions& options)
    : shown_(shown),
      options_(options),
      frames_(shown.specification(), options.tf_prefix),
      recorder_(options.recorder),
      joint_states_publisher_(node.advertise<sensor_msgs::JointState>("joint_states", kState)),
      imu_publisher_(node.advertise<sensor_msgs::Imu>("imu", kState)),
      contacts_publisher_(node.advertise<walker_sim::Contacts>("contacts", kState)),
      odometry_publisher_(node.advertise<nav_msgs::Odometry>("odom", kState)),
      reward_publisher_(node.advertise<std_msgs::Float64>("reward", kState)),
      observation_publisher_(node.advertise<std_msgs::Float64MultiArray>("observation", kState)),
      transition_publisher_(
          recorder_.advertise<walker_sim::Transition>(node, "transition", kRecord, !kLatched)),
      episode_publisher_(
          recorder_.advertise<walker_sim::Episode>(node, "episode", kRecord, kLatched)),
      restored_publisher_(
          recorder_.advertise<walker_sim::EpisodeRecord>(node, "restored", kState, kLatched)),
      spec_publisher_(
          recorder_.advertise<walker_sim::EnvironmentSpec>(node, "spec", kState, kLatched)),
      tf_publisher_(node.advertise<tf2_msgs::TFMessage>("/tf", kRecord)),
      tf_static_publisher_(node.advertise<tf2_msgs::TFMessage>("/tf_static", kRecord, kLatched)),
      markers_(node, shown, frames_.odometry) {
  if (shown.specification().range_finder.num_rays != 0) {
    scan_publisher_ = node.advertise<sensor_msgs::LaserScan>("scan", kState);
  }
}

void Publishers::publish_constants(ros::Time stamp) {
  walker_sim::EnvironmentSpec spec;
  fill(shown_.specification(), options_, spec);
  spec_publisher_.publish(spec);
  tf_static_publisher_.publish(static_transforms(shown_.specification(), frames_, stamp));
}

void Publishers::publish_reset(ros::Time stamp) {
  publish_episode(stamp);
  if (shown_.state().error.empty()) markers_.begin_episode(stamp);  // else there is none to tell of
  publish_state(stamp);
}

void Publishers::publish_restored(const walker_sim::EpisodeRecord& record, ros::Time stamp) {
  restored_publisher_.publish(record);
  publish_reset(stamp);
}

void Publishers::publish_step(ros::Time stamp) {
  publish_state(stamp);
  if (shown_.state().has_ended()) publish_episode(stamp);
}

void Publishers::publish_state(ros::Time stamp) {
  const EpisodeState& state = shown_.state();
  const bool simulation_failed = !state.error.empty();
  if (!simulation_failed) {
    publish_sensors(stamp);
    markers_.publish_state(stamp);
  }
  if (anybody_listens(reward_publisher_)) {
    reward_.data = state.reward;
    reward_publisher_.publish(reward_);
  }
  if (anybody_listens(observation_publisher_)) {
    observation_.data = state.observation;
    observation_publisher_.publish(observation_);
  }
  publish_if_heard(transition_publisher_, transition_, state, frames_, stamp);
}

void Publishers::publish_sensors(ros::Time stamp) {
  const bool anybody = anybody_listens(tf_publisher_) || anybody_listens(joint_states_publisher_) ||
                       (scan_publisher_ && anybody_listens(scan_publisher_)) ||
                       anybody_listens(imu_publisher_) || anybody_listens(contacts_publisher_) ||
                       anybody_listens(odometry_publisher_);
  if (!anybody) return;
  const Specification& specification = shown_.specification();
  const Sensors& sensors = shown_.sensors();
  publish_if_heard(tf_publisher_, transforms_, specification, sensors, frames_, stamp);
  publish_if_heard(joint_states_publisher_, joint_states_, specification, sensors, stamp);
  publish_if_heard(imu_publisher_, imu_, sensors, frames_, stamp);
  publish_if_heard(contacts_publisher_, contacts_, specification, sensors, frames_, stamp);
  publish_if_heard(odometry_publisher_, odometry_, sensors, frames_, stamp);
  if (scan_publisher_) {
    publish_if_heard(scan_publisher_, scan_, specification, sensors, frames_, stamp);
  }
}

void Publishers::publish_episode(ros::Time stamp) {
  fill(shown_.state(), frames_, stamp, episode_);
  episode_publisher_.publish(episode_);
}

}  // namespace walker
