#include "agents/sensor_messages.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "base/shortest_text.h"

namespace walker {
namespace {

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
}

}  // namespace walker
