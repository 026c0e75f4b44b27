#include "server/outputs.h"

#include <stdexcept>
#include <utility>

#include <ros/advertise_options.h>
#include <boost/make_shared.hpp>

#include "ros/message_conversions.h"

namespace walker {
namespace {

constexpr std::uint32_t kState = 1;      // only the newest state matters
constexpr std::uint32_t kRecord = 1000;  // a recorder may get no processor for seconds
constexpr bool kLatched = true;
// A subscriber that connects during a step may receive that step as well, and transforms with equal
// stamps make it warn: late subscribers are served only if no step is under way.
constexpr std::chrono::milliseconds kQuiet{200};
// A state that the pace has held back is shown after so long without another.
constexpr std::chrono::milliseconds kPause{1};

}  // namespace

Outputs::Outputs(ros::NodeHandle& node, Pool& pool, SimulationClock& clock,
                 const ServerOptions& options, const RenderThread::MakeRenderer& make_renderer)
    : shown_(pool.walker(options.shown_environment)),
      clock_(clock),
      options_(options),
      frames_(shown_.specification(), options.tf_prefix),
      pace_(options.mode == Mode::lockstep ? options.max_topic_rate : 0),
      joint_states_{advertise_state<sensor_msgs::JointState>(node, "joint_states", kState,
                                                             &Outputs::send_joint_states),
                    {}},
      imu_{node.advertise<sensor_msgs::Imu>("imu", kState), {}},
      contacts_{node.advertise<walker_sim::Contacts>("contacts", kState), {}},
      odometry_{node.advertise<nav_msgs::Odometry>("odom", kState), {}},
      reward_{node.advertise<std_msgs::Float64>("reward", kState), {}},
      observation_{node.advertise<std_msgs::Float64MultiArray>("observation", kState), {}},
      transition_{node.advertise<walker_sim::Transition>("transition", kRecord), {}},
      progress_{node.advertise<walker_sim::Episode>("progress", kListenerQueue), {}},
      transforms_{advertise_state<tf2_msgs::TFMessage>(node, "/tf", kListenerQueue,
                                                       &Outputs::send_transforms),
                  {}},
      episode_publisher_(node.advertise<walker_sim::Episode>("episode", kRecord, kLatched)),
      record_publisher_(advertise_records(node)),
      spec_publisher_(node.advertise<walker_sim::EnvironmentSpec>("spec", kState, kLatched)),
      static_transforms_publisher_(
          node.advertise<tf2_msgs::TFMessage>("/tf_static", kListenerQueue, kLatched)),
      markers_(node, shown_, frames_.odometry),
      camera_(node, pool, frames_, options, make_renderer) {
  if (shown_.specification().range_finder.num_rays != 0) {
    scan_.publisher = node.advertise<sensor_msgs::LaserScan>("scan", kState);
  }
}

template <typename Message>
ros::Publisher Outputs::advertise_state(
    ros::NodeHandle& node, const char* topic, std::uint32_t queue_size,
    void (Outputs::*send)(const ros::SingleSubscriberPublisher&)) {
  auto options = ros::AdvertiseOptions::create<Message>(
      topic, queue_size, [this, send](const auto& subscriber) { (this->*send)(subscriber); },
      ros::SubscriberStatusCallback(), ros::VoidConstPtr(), &late_subscribers_);
  return node.advertise(options);
}

void Outputs::catch_up() {
  const auto now = std::chrono::steady_clock::now();
  if (is_behind_ && now - reached_at_ >= kPause) show(now);
  if (!is_behind_ && now - shown_at_ > kQuiet && !late_subscribers_.isEmpty())
    late_subscribers_.callAvailable();
}

std::chrono::steady_clock::duration Outputs::longest_wait() const {
  return is_behind_ ? kPause : std::chrono::steady_clock::duration::max();
}

void Outputs::send_transforms(const ros::SingleSubscriberPublisher& subscriber) {
  if (!has_state()) return;
  const ros::Time stamp = stamps_[shown_.state().step % stamps_.size()];
  to_message(shown_.specification(), shown_.sensors(), frames_, stamp, transforms_.message);
  subscriber.publish(transforms_.message);
}

void Outputs::send_joint_states(const ros::SingleSubscriberPublisher& subscriber) {
  if (!has_state()) return;
  const Sensors& sensors = shown_.measurements();
  const std::optional<ros::Time> stamp = measured_at();
  if (!stamp) return;
  to_message(shown_.specification(), sensors, *stamp, joint_states_.message);
  subscriber.publish(joint_states_.message);
}

/// Counts the recorder's connections: it misses messages that are published before it connects.
ros::Publisher Outputs::advertise_records(ros::NodeHandle& node) {
  const auto count = [this](const ros::SingleSubscriberPublisher& listener, int change) {
    if (listener.getSubscriberName() == options_.recorder) recorder_connections_ += change;
  };
  return node.advertise<walker_sim::EpisodeRecord>(
      "episode_record", kRecord, [count](const auto& listener) { count(listener, 1); },
      [count](const auto& listener) { count(listener, -1); });
}

std::string Outputs::recorder_complaint() const {
  if (options_.recorder.empty() || recorder_connections_ > 0) return "";
  return options_.recorder + " does not listen to episode_record (parameter wait_for_recorder)";
}

void Outputs::publish_constants() {
  clock_.publish();
  publish_spec();
  static_transforms_publisher_.publish(
      static_transforms(shown_.specification(), frames_, clock_.now()));
}

void Outputs::publish_spec() { spec_publisher_.publish(spec()); }

void Outputs::publish_reset() {
  // Forgets the stamps of the episode before.
  stamps_.resize(shown_.observation_delay() + 1U);
  first_stamp_ = shown_.state().step;
  observed_step_.reset();
  published_step_.reset();
  is_scene_new_ = true;
  // A world that delays measurements keeps those that follow the first.
  if (shown_.state().error.empty() && is_any_sensor_heard()) shown_.measurements();
  publish_episode();
  publish_state();
  if (shown_.state().has_ended()) publish_record();  // failed, or restored as ended
  publish_picture();
}

void Outputs::publish_step() {
  publish_state();
  if (shown_.state().has_ended()) {
    publish_episode();
    publish_record();
  }
  publish_picture();
}

void Outputs::publish_picture() {
  if (!camera_.is_due(clock_.now())) return;
  clock_.publish();
  camera_.show(clock_.now());
}

void Outputs::publish_record() {
  if (record_publisher_.getNumSubscribers() == 0) return;
  clock_.publish();
  record_publisher_.publish(record());
}

std::optional<walker_sim::EpisodeRecord> Outputs::abandoned_record() const {
  const EpisodeState& state = shown_.state();
  const bool is_running = state.has_begun() && !state.has_ended();
  if (!is_running || record_publisher_.getNumSubscribers() == 0) return std::nullopt;
  walker_sim::EpisodeRecord message = record();
  message.episode.end_reason = "reset before its end";
  return message;
}

void Outputs::publish_abandoned(const std::optional<walker_sim::EpisodeRecord>& record) {
  if (!record) return;
  clock_.publish();
  record_publisher_.publish(*record);
}

void Outputs::publish_state() {
  const EpisodeState& state = shown_.state();
  stamp_ = clock_.now();
  if (state.error.empty()) {
    stamps_[state.step % stamps_.size()] = stamp_;
    const std::uint32_t step = shown_.observed_step();
    // A world that drops observations repeats the step of an older one, whose stamp the ring may
    // have lost.
    if (std::exchange(observed_step_, step) != step) {
      const bool has_stamp = step >= first_stamp_;
      observed_at_ = has_stamp ? std::optional(stamps_[step % stamps_.size()]) : std::nullopt;
    }
  }
  is_behind_ = true;
  reached_at_ = std::chrono::steady_clock::now();
  if (pace_.take(reached_at_)) show(reached_at_);
  if (!transition_.is_heard()) return;
  clock_.publish();
  to_message(state, frames_, stamp_, transition_.message);
  transition_.publish();
}

/// Publishes the present state on the paced topics.
void Outputs::show(std::chrono::steady_clock::time_point now) {
  const EpisodeState& state = shown_.state();
  is_behind_ = false;  // also if what follows throws
  shown_at_ = now;
  clock_.publish();
  late_subscribers_.clear();  // they receive what follows
  if (state.error.empty()) {  // else there is no scene
    if (std::exchange(is_scene_new_, false)) markers_.begin_episode(stamp_);
    if (transforms_.is_heard()) {
      to_message(shown_.specification(), shown_.sensors(), frames_, stamp_, transforms_.message);
      transforms_.publish();
    }
    publish_measurements();
    markers_.publish_state(stamp_);
  }
  if (reward_.is_heard()) {
    reward_.message.data = state.reward;
    reward_.publish();
  }
  if (observation_.is_heard()) {
    observation_.message.data = state.observation;
    observation_.publish();
  }
  progress_.publish_if_heard(state, frames_, stamp_);
}

/// Publishes what the walker has observed, once: a world may delay measurements and repeat them.
void Outputs::publish_measurements() {
  if (std::exchange(published_step_, observed_step_) == observed_step_) return;
  if (!is_any_sensor_heard()) return;
  const Specification& specification = shown_.specification();
  const Sensors& sensors = shown_.measurements();
  const std::optional<ros::Time> stamp = measured_at();
  if (!stamp) return;
  joint_states_.publish_if_heard(specification, sensors, *stamp);
  imu_.publish_if_heard(sensors, frames_, *stamp);
  contacts_.publish_if_heard(specification, sensors, frames_, *stamp);
  odometry_.publish_if_heard(sensors, frames_, *stamp);
  scan_.publish_if_heard(specification, sensors, frames_, *stamp);
}

bool Outputs::is_any_sensor_heard() const {
  return joint_states_.is_heard() || scan_.is_heard() || imu_.is_heard() || contacts_.is_heard() ||
         odometry_.is_heard();
}

bool Outputs::has_state() const {
  return shown_.state().has_begun() && shown_.state().error.empty();
}

/// Returns the stamp of the present measurements; nullopt if they precede the first subscriber, or
/// their stamp a ~restore.
std::optional<ros::Time> Outputs::measured_at() const {
  return shown_.measured_step() == observed_step_ ? observed_at_ : std::nullopt;
}

/// Publishes the message as a shared_ptr: without a subscriber roscpp then wakes no thread. Such a
/// thread would take a core from a client that steps without a pause.
void Outputs::publish_episode() {
  if (episode_publisher_.getNumSubscribers() > 0) clock_.publish();
  const auto message = boost::make_shared<walker_sim::Episode>();
  to_message(shown_.state(), frames_, clock_.now(), *message);
  episode_publisher_.publish(message);
}

walker_sim::Transition Outputs::message(const EpisodeState& state) const {
  walker_sim::Transition message;
  to_message(state, frames_, clock_.now(), message);
  return message;
}

walker_sim::EnvironmentSpec Outputs::spec() const {
  walker_sim::EnvironmentSpec message;
  to_message(shown_.specification(), options_, shown_.world(), message);
  return message;
}

walker_sim::EpisodeRecord Outputs::message(EpisodeRecord record) const {
  walker_sim::EpisodeRecord message;
  message.spec = spec();
  to_message(shown_.state(), frames_, clock_.now(), message.episode);
  to_message(std::move(record), message);
  return message;
}

walker_sim::EpisodeRecord Outputs::record() const {
  EpisodeRecord record;
  try {
    record = shown_.record();
    // NOLINTNEXTLINE(bugprone-empty-catch): the message then has only number, length and return
  } catch (const std::logic_error&) {
  }
  return message(std::move(record));
}

}  // namespace walker
