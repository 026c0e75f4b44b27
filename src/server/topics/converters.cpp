#include "server/topics/converters.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>

#include <sensor_msgs/distortion_models.h>
#include <sensor_msgs/image_encodings.h>
#include <tf2_eigen/tf2_eigen.h>

#include "base/limits.h"
#include "base/parameter_text.h"
#include "base/printable_text.h"
#include "base/shortest_text.h"
#include "description/link_tree.h"
#include "ros/message_conversions.h"
#include "walker_sim/registry.h"

namespace walker {
namespace {

/// Names a frame as robot_state_publisher does.
std::string prefixed(const std::string& tf_prefix, const std::string& frame) {
  return tf_prefix.empty() ? frame : tf_prefix + "/" + frame;
}

void stamp_header(ros::Time stamp, const std::string& frame, std_msgs::Header& header) {
  header.stamp = stamp;
  header.frame_id = frame;
}

geometry_msgs::TransformStamped transform(const std::string& parent, const std::string& child,
                                          const Eigen::Isometry3d& pose, ros::Time stamp) {
  geometry_msgs::TransformStamped message = tf2::eigenToTransform(pose);
  stamp_header(stamp, parent, message.header);
  message.child_frame_id = child;
  return message;
}

/// Pose in the trunk's frame: at its origin and gravity-aligned, X forward, Y up, at any attitude.
Eigen::Isometry3d lidar_pose(const Quaternion& attitude) {
  const Eigen::AngleAxisd roll(M_PI / 2, Eigen::Vector3d::UnitX());
  return Eigen::Isometry3d(to_eigen(attitude).conjugate() * roll);
}

/// Appends for each joint the pose in its parent of the link that it turns, from the bodies' poses.
void append_joints(const Specification& specification, const Sensors& sensors, const Frames& frames,
                   ros::Time stamp, tf2_msgs::TFMessage& message) {
  for (std::size_t i = 0; i < specification.joints.size(); ++i) {
    const Joint& joint = specification.joints[i];
    const auto parent = std::find_if(specification.links.begin(), specification.links.end(),
                                     [&](const Link& link) { return link.name == joint.parent; });
    const auto index = static_cast<std::size_t>(parent - specification.links.begin());
    const Eigen::Isometry3d base = to_eigen(sensors.link_poses[index]);
    const Eigen::Isometry3d turned =
        to_eigen(sensors.link_poses[i + 1]) * to_eigen(joint.child_frame).inverse();
    message.transforms.push_back(
        transform(frames.links[index], frames.turned[i], base.inverse() * turned, stamp));
  }
}

std::size_t index_of_link(const Frames& frames, const std::string& name) {
  const auto link = std::find(frames.links.begin(), frames.links.end(), name);
  if (link != frames.links.end()) return link - frames.links.begin();
  if (name == frames.base_link) return 0;
  std::vector<std::string> known = frames.links;
  if (frames.base_link != frames.trunk) known.push_back(frames.base_link);
  refuse_unknown("frame_id " + printable(name, kMaxQuotedBytes), name, known);
}

/// Returns a vector of a push, whose components are checked.
Eigen::Vector3d checked_vector(const std::string& name, const geometry_msgs::Vector3& vector,
                               const char* unit) {
  const auto check = [&](const char* component, double value) {
    if (std::abs(value) <= kMaxPush) return;
    throw std::invalid_argument(name + component + " = " + shortest_text(value) + unit +
                                "; must be in [-" + shortest_text(kMaxPush) + ", " +
                                shortest_text(kMaxPush) + "]");
  };
  check(".x", vector.x);
  check(".y", vector.y);
  check(".z", vector.z);
  return {vector.x, vector.y, vector.z};
}

/// @param out_of_plane component of `vector` along which the walker cannot move
void check_plane(const char* name, const Eigen::Vector3d& vector, double out_of_plane,
                 const char* unit) {
  constexpr double kRounding = 1e-6;  // of a rotation by a transform of single precision
  if (std::abs(out_of_plane) <= kRounding * vector.norm()) return;
  throw std::invalid_argument(std::string(name) + " acts with " + shortest_text(out_of_plane) +
                              unit +
                              " out of the walker's plane of motion (x and z of odom); must be 0");
}

}  // namespace

Frames::Frames(const Specification& specification, const std::string& tf_prefix)
    : odometry(prefixed(tf_prefix, "odom")),
      trunk(prefixed(tf_prefix, specification.links.front().name)),
      base_link(prefixed(tf_prefix, "base_link")),
      lidar(prefixed(tf_prefix, "lidar")),
      camera(prefixed(tf_prefix, "camera")) {
  for (const Link& link : specification.links) {
    const bool is_trunk = &link == &specification.links.front();
    if (link.name == "odom" || link.name == "lidar" || link.name == "camera" ||
        (link.name == "base_link" && !is_trunk)) {
      throw std::invalid_argument("link " + link.name + ": another frame has this name");
    }
    links.push_back(prefixed(tf_prefix, link.name));
  }
  for (const std::string& name : turned_links(specification)) {
    turned.push_back(prefixed(tf_prefix, name));
  }
}

void to_message(const EpisodeState& state, const Frames& frames, ros::Time stamp,
                walker_sim::Transition& message) {
  stamp_header(stamp, frames.odometry, message.header);
  message.environment = state.environment;
  message.episode = state.episode;
  message.step = state.step;
  message.action = state.action;
  message.observation = state.observation;
  message.reward = state.reward;
  message.episode_return = state.episode_return;
  message.terminated = state.terminated;
  message.truncated = state.truncated;
  message.info = state.info;
  message.error = state.error;
}

void to_message(const EpisodeState& state, const Frames& frames, ros::Time stamp,
                walker_sim::Episode& message) {
  stamp_header(stamp, frames.odometry, message.header);
  message.environment = state.environment;
  message.episode = state.episode;
  message.has_seed = state.seed.has_value();
  message.seed = state.seed.value_or(0);
  std::copy(state.generator_state.begin(), state.generator_state.end(),
            message.generator_state.begin());
  to_message(state.drawn_world(), message.world);
  message.length = state.step;
  message.episode_return = state.episode_return;
  message.end_reason = state.end_reason;
}

void to_message(const Specification& specification, const ServerOptions& options,
                const World& world, walker_sim::EnvironmentSpec& message) {
  message.interface_version = walker_sim::EnvironmentSpec::INTERFACE_VERSION;
  message.id = specification.id;
  message.num_envs = options.num_envs;
  message.parameter_names.clear();
  message.parameter_values.clear();
  for (const auto& [name, value] : specification.parameters) {
    message.parameter_names.push_back(name);
    message.parameter_values.push_back(to_string(value));
  }
  to_message(world, message.world);
  message.observation_size = static_cast<std::uint32_t>(specification.observation_size());
  message.observation_dtype = specification.observation_dtype;
  message.observation_low = specification.observation_low;
  message.observation_high = specification.observation_high;
  message.action_size = static_cast<std::uint32_t>(specification.action_size());
  message.action_low = specification.action_low;
  message.action_high = specification.action_high;
  message.dt = specification.dt;
  message.max_episode_steps = specification.max_episode_steps;
  message.reward_threshold = specification.reward_threshold;
  message.joint_names.clear();
  for (const Joint& joint : specification.joints) message.joint_names.push_back(joint.name);
  message.info_names = specification.info_names;
  message.mode = to_text(options.mode);
  message.autoreset_mode = to_text(options.autoreset_mode);
  message.engine = specification.engine;
  message.engine_version = specification.engine_version;
  message.engine_path = specification.engine_path;
  message.version = version();
}

void to_message(const Specification& specification, const Sensors& sensors, ros::Time stamp,
                sensor_msgs::JointState& message) {
  message.header.stamp = stamp;
  message.name.resize(specification.joints.size());
  std::transform(specification.joints.begin(), specification.joints.end(), message.name.begin(),
                 [](const Joint& joint) { return joint.name; });
  message.position = sensors.joint_position;
  message.velocity = sensors.joint_velocity;
  message.effort = sensors.joint_effort;
}

void to_message(const Specification& specification, const Sensors& sensors, const Frames& frames,
                ros::Time stamp, walker_sim::Contacts& message) {
  stamp_header(stamp, frames.odometry, message.header);
  message.links = specification.contact_links;
  message.in_contact.assign(sensors.contacts.begin(), sensors.contacts.end());
}

void to_message(const Specification& specification, const Sensors& sensors, const Frames& frames,
                ros::Time stamp, sensor_msgs::LaserScan& message) {
  const RangeFinder& finder = specification.range_finder;
  stamp_header(stamp, frames.lidar, message.header);
  message.angle_min = static_cast<float>(finder.angle_minimum);
  message.angle_max = static_cast<float>(
      finder.angle_minimum + static_cast<double>(finder.num_rays - 1) * finder.angle_increment);
  message.angle_increment = static_cast<float>(finder.angle_increment);
  message.time_increment = 0;  // all rays are measured at once
  message.scan_time = static_cast<float>(specification.dt);
  message.range_min = 0;
  message.range_max = static_cast<float>(sensors.maximum_range);
  message.ranges.assign(sensors.ranges.begin(), sensors.ranges.end());
}

void to_message(const Sensors& sensors, const Frames& frames, ros::Time stamp,
                sensor_msgs::Imu& message) {
  const Eigen::Quaterniond attitude = to_eigen(sensors.link_poses.front().orientation);
  const Eigen::Quaterniond to_trunk = attitude.conjugate();
  const Eigen::Vector3d gravity = to_eigen(sensors.gravity);
  stamp_header(stamp, frames.trunk, message.header);
  message.orientation = tf2::toMsg(attitude);
  tf2::toMsg(to_trunk * to_eigen(sensors.angular_velocity), message.angular_velocity);
  tf2::toMsg(to_trunk * (to_eigen(sensors.linear_acceleration) - gravity),
             message.linear_acceleration);
}

void to_message(const Sensors& sensors, const Frames& frames, ros::Time stamp,
                nav_msgs::Odometry& message) {
  const Pose& trunk = sensors.link_poses.front();
  const Eigen::Quaterniond attitude = to_eigen(trunk.orientation);
  const Eigen::Quaterniond to_trunk = attitude.conjugate();
  stamp_header(stamp, frames.odometry, message.header);
  message.child_frame_id = frames.trunk;
  message.pose.pose.position = tf2::toMsg(to_eigen(trunk.position));
  message.pose.pose.orientation = tf2::toMsg(attitude);
  tf2::toMsg(to_trunk * to_eigen(sensors.linear_velocity), message.twist.twist.linear);
  tf2::toMsg(to_trunk * to_eigen(sensors.angular_velocity), message.twist.twist.angular);
}

void to_message(const Specification& specification, const Sensors& sensors, const Frames& frames,
                ros::Time stamp, tf2_msgs::TFMessage& message) {
  const Pose& trunk = sensors.link_poses.front();
  message.transforms.clear();
  message.transforms.push_back(transform(frames.odometry, frames.trunk, to_eigen(trunk), stamp));
  append_joints(specification, sensors, frames, stamp, message);
  if (specification.range_finder.num_rays != 0) {
    message.transforms.push_back(
        transform(frames.trunk, frames.lidar, lidar_pose(trunk.orientation), stamp));
  }
}

void to_message(Image& image, const Frames& frames, ros::Time stamp, sensor_msgs::Image& message) {
  const bool has_depth = !image.depth.empty();
  stamp_header(stamp, frames.camera, message.header);
  message.width = image.width;
  message.height = image.height;
  if (has_depth) {
    message.encoding = sensor_msgs::image_encodings::TYPE_32FC1;
    message.step = message.width * static_cast<std::uint32_t>(sizeof(float));
    message.data.resize(image.depth.size() * sizeof(float));
    std::memcpy(message.data.data(), image.depth.data(), message.data.size());
  } else {
    message.encoding = sensor_msgs::image_encodings::RGB8;
    message.step = message.width * 3;
    message.data.swap(image.rgb);
  }
}

void to_message(const Camera& camera, const Frames& frames, ros::Time stamp,
                sensor_msgs::CameraInfo& message) {
  message = sensor_msgs::CameraInfo();
  stamp_header(stamp, frames.camera, message.header);
  message.width = camera.width;
  message.height = camera.height;
  constexpr std::size_t kPlumbBobCoefficients = 5;
  message.distortion_model = sensor_msgs::distortion_models::PLUMB_BOB;
  message.D.assign(kPlumbBobCoefficients, 0);
  if (camera.focal_length == 0) return;
  const double f = camera.focal_length;
  const double x = (camera.width - 1.0) / 2;
  const double y = (camera.height - 1.0) / 2;
  message.K = {f, 0, x, 0, f, y, 0, 0, 1};
  message.R = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  message.P = {f, 0, x, 0, 0, f, y, 0, 0, 0, 1, 0};
}

void to_message(const Pose& camera, const Frames& frames, ros::Time stamp,
                tf2_msgs::TFMessage& message) {
  message.transforms.assign(1, transform(frames.odometry, frames.camera, to_eigen(camera), stamp));
}

tf2_msgs::TFMessage static_transforms(const Specification& specification, const Frames& frames,
                                      ros::Time stamp) {
  tf2_msgs::TFMessage message;
  if (frames.base_link != frames.trunk) {
    message.transforms.push_back(
        transform(frames.trunk, frames.base_link, Eigen::Isometry3d::Identity(), stamp));
  }
  for (std::size_t i = 0; i < specification.joints.size(); ++i) {
    if (frames.turned[i] == frames.links[i + 1]) continue;  // no hinge link in between
    message.transforms.push_back(transform(frames.turned[i], frames.links[i + 1],
                                           to_eigen(specification.joints[i].child_frame), stamp));
  }
  return message;
}

LinkWrench to_link_wrench(const geometry_msgs::WrenchStamped& message, const Frames& frames,
                          const Sensors& sensors) {
  const std::size_t link = index_of_link(frames, message.header.frame_id);
  const Eigen::Quaterniond attitude = to_eigen(sensors.link_poses[link].orientation);
  const Eigen::Vector3d force = attitude * checked_vector("force", message.wrench.force, " N");
  const Eigen::Vector3d torque = attitude * checked_vector("torque", message.wrench.torque, " N m");
  check_plane("force", force, force.y(), " N");
  check_plane("torque", torque, std::hypot(torque.x(), torque.z()), " N m");
  return {static_cast<std::uint32_t>(link), force.x(), force.z(), torque.y()};
}

}  // namespace walker
