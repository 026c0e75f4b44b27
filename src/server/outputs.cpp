#include "server/outputs.h"

#include <utility>

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

Outputs::Outputs(ros::NodeHandle& node, Environments& environments, const ServerOptions& options,
                 const RenderThread::MakeRenderer& make_renderer)
    : shown_(environments.shown()),
      options_(options),
      frames_(shown_.specification(), options.tf_prefix),
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
      markers_(node, shown_, frames_.odometry),
      camera_(node, environments, frames_, options, make_renderer) {
  if (shown_.specification().range_finder.num_rays != 0) {
    scan_publisher_ = node.advertise<sensor_msgs::LaserScan>("scan", kState);
  }
}

void Outputs::publish_constants(ros::Time stamp) {
  spec_publisher_.publish(spec());
  tf_static_publisher_.publish(static_transforms(shown_.specification(), frames_, stamp));
}

void Outputs::publish_reset(ros::Time stamp) {
  publish_episode(stamp);
  if (shown_.state().error.empty()) markers_.begin_episode(stamp);  // else there is none to tell of
  publish_state(stamp);
  camera_.show(stamp);
}

void Outputs::publish_restored(const walker_sim::EpisodeRecord& record, ros::Time stamp) {
  restored_publisher_.publish(record);
  publish_reset(stamp);
}

void Outputs::publish_step(ros::Time stamp) {
  publish_state(stamp);
  if (shown_.state().has_ended()) publish_episode(stamp);
  camera_.show(stamp);
}

void Outputs::publish_state(ros::Time stamp) {
  stamp_ = stamp;
  is_converted_ = false;
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
  if (anybody_listens(transition_publisher_)) transition_publisher_.publish(transition());
}

void Outputs::publish_sensors(ros::Time stamp) {
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

void Outputs::publish_episode(ros::Time stamp) {
  fill(shown_.state(), frames_, stamp, episode_);
  episode_publisher_.publish(episode_);
}

const walker_sim::Transition& Outputs::transition() {
  if (!std::exchange(is_converted_, true)) fill(shown_.state(), frames_, stamp_, transition_);
  return transition_;
}

walker_sim::Transition Outputs::take_transition() {
  transition();
  is_converted_ = false;
  return std::move(transition_);
}

walker_sim::EnvironmentSpec Outputs::spec() const {
  walker_sim::EnvironmentSpec message;
  fill(shown_.specification(), options_, message);
  return message;
}

walker_sim::EpisodeRecord Outputs::message(EpisodeRecord record, ros::Time stamp) const {
  walker_sim::EpisodeRecord message;
  message.spec = spec();
  fill(shown_.state(), frames_, stamp, message.episode);
  message.actions = std::move(record.actions);
  return message;
}

}  // namespace walker
