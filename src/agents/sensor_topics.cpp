#include "agents/sensor_topics.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include <message_filters/sync_policies/approximate_time.h>
#include <message_filters/sync_policies/exact_time.h>
#include <message_filters/synchronizer.h>
#include <ros/console.h>
#include <ros/transport_hints.h>

#include "base/shortest_text.h"
#include "ros/checked_message.h"

namespace walker {
namespace {

constexpr std::uint32_t kQueue = 10;  // messages per topic that wait for the other topics
constexpr double kReportPeriod = 1;   // wall time [s]

/// Returns the value at the position of `name` in `names`.
/// @param what begins the error message
/// @throws std::invalid_argument if the name or its value is missing
template <typename Value>
Value find(const std::vector<std::string>& names, const std::string& name, const char* what,
           const std::vector<Value>& values) {
  const auto found = std::find(names.begin(), names.end(), name);
  const auto place = static_cast<std::size_t>(found - names.begin());
  if (found == names.end()) throw std::invalid_argument(what + name + " is missing");
  if (place >= values.size()) throw std::invalid_argument(what + name + " has no value");
  return values[place];
}

/// @param covariance begins with -1 if the value is not measured (REP 145)
void check_measured(const char* field, const boost::array<double, 9>& covariance) {
  if (covariance[0] != -1) return;
  throw std::invalid_argument(std::string("imu: ") + field +
                              " is missing (its covariance begins with -1)");
}

Vector3 to_vector3(const geometry_msgs::Vector3& vector) { return {vector.x, vector.y, vector.z}; }

void check_angle(const char* name, double angle, double right) {
  constexpr double kTolerance = 1e-3;  // [rad]
  if (std::abs(angle - right) <= kTolerance) return;
  throw std::invalid_argument(std::string("scan: ") + name + " = " + fixed_text(angle) +
                              " rad; must be " + fixed_text(right));
}

}  // namespace

void take(const sensor_msgs::JointState& message, const Specification& specification,
          Measurements& measurements) {
  measurements.joint_position.resize(specification.joints.size());
  measurements.joint_velocity.resize(specification.joints.size());
  for (std::size_t i = 0; i < specification.joints.size(); ++i) {
    const std::string& name = specification.joints[i].name;
    measurements.joint_position[i] =
        find(message.name, name, "joint_states: position of joint ", message.position);
    measurements.joint_velocity[i] =
        find(message.name, name, "joint_states: velocity of joint ", message.velocity);
  }
}

void take(const sensor_msgs::Imu& message, const Specification& /*specification*/,
          Measurements& measurements) {
  check_measured("orientation", message.orientation_covariance);
  check_measured("angular_velocity", message.angular_velocity_covariance);
  const geometry_msgs::Quaternion& attitude = message.orientation;
  measurements.orientation = {attitude.x, attitude.y, attitude.z, attitude.w};
  measurements.angular_velocity = to_vector3(message.angular_velocity);
}

void take(const nav_msgs::Odometry& message, const Specification& /*specification*/,
          Measurements& measurements) {
  const geometry_msgs::Point& position = message.pose.pose.position;
  measurements.position = {position.x, position.y, position.z};
  measurements.linear_velocity = to_vector3(message.twist.twist.linear);
}

void take(const walker_sim::Contacts& message, const Specification& specification,
          Measurements& measurements) {
  measurements.contacts.clear();
  for (const std::string& link : specification.contact_links) {
    measurements.contacts.push_back(
        find(message.links, link, "contacts: link ", message.in_contact));
  }
}

void take(const sensor_msgs::LaserScan& message, const Specification& specification,
          Measurements& measurements) {
  const RangeFinder& finder = specification.range_finder;
  check_angle("angle_min", double{message.angle_min}, finder.angle_minimum);
  check_angle("angle_increment", double{message.angle_increment}, finder.angle_increment);
  measurements.ranges.assign(message.ranges.begin(), message.ranges.end());
  // The message rounds it to single precision.
  const bool is_own = message.range_max == static_cast<float>(finder.maximum_range);
  measurements.maximum_range = is_own ? finder.maximum_range : double{message.range_max};
}

SensorTopics::SensorTopics(ros::NodeHandle& node, const Specification& specification,
                           double stamp_tolerance, Receiver receiver)
    : specification_(specification),
      stamp_tolerance_(stamp_tolerance),
      receiver_(std::move(receiver)),
      timer_(node.createWallTimer(ros::WallDuration(kReportPeriod),
                                  [this](const ros::WallTimerEvent&) { report(); })) {
  subscribe(node, "joint_states", joint_states_);
  subscribe(node, "imu", imu_);
  subscribe(node, "odom", odometry_);
  subscribe(node, "contacts", contacts_);
  const RangeFinder& finder = specification.range_finder;
  if (finder.num_rays != 0 && finder.is_observed) {
    subscribe(node, "scan", scan_);
    match_by_stamp(joint_states_, imu_, odometry_, contacts_, scan_);
  } else {
    match_by_stamp(joint_states_, imu_, odometry_, contacts_);
  }
}

bool SensorTopics::are_connected() const {
  return std::all_of(inputs_.begin(), inputs_.end(), [](const std::unique_ptr<Input>& input) {
    return input->subscriber.getNumPublishers() > 0;
  });
}

template <typename Message>
void SensorTopics::subscribe(ros::NodeHandle& node, const std::string& topic,
                             message_filters::PassThrough<Message>& messages) {
  Input& input = *inputs_.emplace_back(std::make_unique<Input>());
  input.subscriber = subscribe_checked<Message>(
      node, topic, kQueue,
      [&input, &messages](const boost::shared_ptr<const Message>& message) {
        ++input.unmatched;
        input.newest = message->header.stamp;
        messages.add(message);
      },
      ros::TransportHints().tcpNoDelay());
}

template <typename... Messages>
void SensorTopics::match_by_stamp(message_filters::PassThrough<Messages>&... messages) {
  using message_filters::Synchronizer;
  using Exact = message_filters::sync_policies::ExactTime<Messages...>;
  using Approximate = message_filters::sync_policies::ApproximateTime<Messages...>;
  void (SensorTopics::*callback)(const boost::shared_ptr<const Messages>&...) =
      &SensorTopics::receive<Messages...>;
  if (stamp_tolerance_ == 0) {
    auto exact = std::make_shared<Synchronizer<Exact>>(Exact(kQueue), messages...);
    exact->registerCallback(callback, this);
    synchronizer_ = exact;
  } else {
    const ros::Duration tolerance(stamp_tolerance_);
    auto approximate =
        std::make_shared<Synchronizer<Approximate>>(Approximate(kQueue), messages...);
    approximate->setMaxIntervalDuration(tolerance);
    // With this bound a set is complete when its last message arrives. Without it the policy would
    // wait for later messages that might match better.
    approximate->setInterMessageLowerBound(tolerance * 2);
    approximate->registerCallback(callback, this);
    synchronizer_ = approximate;
  }
}

template <typename... Messages>
void SensorTopics::receive(const boost::shared_ptr<const Messages>&... messages) {
  has_received_ = true;
  for (const std::unique_ptr<Input>& input : inputs_) input->unmatched = 0;
  try {
    (take(*messages, specification_, measurements_), ...);
  } catch (const std::invalid_argument& error) {
    set_warning(error.what());
    return;
  }
  receiver_(std::min({messages->header.stamp...}), measurements_);
}

void SensorTopics::report() {
  if (warning_.empty() && !has_received_) warning_ = missing_text();
  if (!warning_.empty()) ROS_WARN_STREAM("No observation: " << warning_);
  warning_.clear();
  has_received_ = false;
  for (const std::unique_ptr<Input>& input : inputs_) input->unmatched = 0;
}

/// Empty if all topics have publishers and are silent: the server is paused or waits for a reset.
std::string SensorTopics::missing_text() const {
  const auto is_active = [](const std::unique_ptr<Input>& input) {
    constexpr int kMinUnmatched = 2;  // the set of a single message may still be in transit
    return input->unmatched >= kMinUnmatched;
  };
  const bool is_any_active = std::any_of(inputs_.begin(), inputs_.end(), is_active);
  std::string missing;
  for (const std::unique_ptr<Input>& input : inputs_) {
    const bool is_silent = input->unmatched == 0;
    if (is_silent && (is_any_active || input->subscriber.getNumPublishers() == 0)) {
      missing += " " + input->subscriber.getTopic();
    }
  }
  if (!missing.empty()) return "no messages on" + missing;
  if (!is_any_active) return "";
  const auto [oldest, newest] = std::minmax_element(
      inputs_.begin(), inputs_.end(),
      [](const auto& one, const auto& other) { return one->newest < other->newest; });
  constexpr double kSeconds = 1e-9;
  const std::uint64_t nanoseconds = (*newest)->newest.toNSec() - (*oldest)->newest.toNSec();
  ClassicStream apart;
  apart << "the stamps of " << (*oldest)->subscriber.getTopic() << " and "
        << (*newest)->subscriber.getTopic() << " are "
        << static_cast<double>(nanoseconds) * kSeconds
        << " s apart; parameter stamp_tolerance = " << stamp_tolerance_ << " s";
  return apart.str();
}

}  // namespace walker
