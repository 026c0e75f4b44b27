// gazebo_msgs' services of physics properties, without that package: client and server need only
// the same type name, MD5 sum and order of fields.
#pragma once

#include <cstdint>
#include <string>

#include <geometry_msgs/Vector3.h>
#include <ros/message_traits.h>
#include <ros/serialization.h>
#include <ros/service_traits.h>

namespace walker::gazebo {

/// gazebo_msgs/ODEPhysics: settings of the engine that Gazebo runs by default.
struct OdePhysics {
  std::uint8_t auto_disable_bodies = 0;
  std::uint32_t sor_pgs_precon_iters = 0;
  std::uint32_t sor_pgs_iters = 0;
  double sor_pgs_w = 0;
  double sor_pgs_rms_error_tol = 0;
  double contact_surface_layer = 0;
  double contact_max_correcting_vel = 0;
  double cfm = 0;
  double erp = 0;
  std::uint32_t max_contacts = 0;
};

struct GetPhysicsProperties {
  static constexpr const char* kType = "gazebo_msgs/GetPhysicsProperties";
  static constexpr const char* kMd5Sum = "575a5e74786981b7df2e3afc567693a6";

  struct Request {};
  struct Response {
    double time_step = 0;            ///< [s]
    std::uint8_t pause = 0;          ///< 1: nothing moves without a service call
    double max_update_rate = 0;      ///< steps per second of wall time; 0: no limit [Hz]
    geometry_msgs::Vector3 gravity;  ///< [m/s^2]
    OdePhysics ode_config;
    std::uint8_t success = 0;
    std::string status_message;
  };
};

struct SetPhysicsProperties {
  static constexpr const char* kType = "gazebo_msgs/SetPhysicsProperties";
  static constexpr const char* kMd5Sum = "97e2057080558ce4730434b5fae75c91";

  struct Request {
    double time_step = 0;            ///< [s]
    double max_update_rate = 0;      ///< as in GetPhysicsProperties [Hz]
    geometry_msgs::Vector3 gravity;  ///< [m/s^2]
    OdePhysics ode_config;
  };
  struct Response {
    std::uint8_t success = 0;
    std::string status_message;
  };
};

}  // namespace walker::gazebo

// ---------------------------------------------------------------- traits that roscpp requires

namespace ros::service_traits {

template <>
struct DataType<walker::gazebo::GetPhysicsProperties> {
  static const char* value() { return walker::gazebo::GetPhysicsProperties::kType; }
};
template <>
struct MD5Sum<walker::gazebo::GetPhysicsProperties> {
  static const char* value() { return walker::gazebo::GetPhysicsProperties::kMd5Sum; }
};
template <>
struct DataType<walker::gazebo::SetPhysicsProperties> {
  static const char* value() { return walker::gazebo::SetPhysicsProperties::kType; }
};
template <>
struct MD5Sum<walker::gazebo::SetPhysicsProperties> {
  static const char* value() { return walker::gazebo::SetPhysicsProperties::kMd5Sum; }
};

}  // namespace ros::service_traits

namespace ros::message_traits {

template <>
struct DataType<walker::gazebo::GetPhysicsProperties::Request> {
  static const char* value() { return "gazebo_msgs/GetPhysicsPropertiesRequest"; }
};
template <>
struct DataType<walker::gazebo::GetPhysicsProperties::Response> {
  static const char* value() { return "gazebo_msgs/GetPhysicsPropertiesResponse"; }
};
template <>
struct DataType<walker::gazebo::SetPhysicsProperties::Request> {
  static const char* value() { return "gazebo_msgs/SetPhysicsPropertiesRequest"; }
};
template <>
struct DataType<walker::gazebo::SetPhysicsProperties::Response> {
  static const char* value() { return "gazebo_msgs/SetPhysicsPropertiesResponse"; }
};

}  // namespace ros::message_traits

namespace ros::serialization {

template <>
struct Serializer<walker::gazebo::OdePhysics> {
  template <typename Stream, typename Message>
  static void allInOne(Stream& stream, Message message) {
    stream.next(message.auto_disable_bodies);
    stream.next(message.sor_pgs_precon_iters);
    stream.next(message.sor_pgs_iters);
    stream.next(message.sor_pgs_w);
    stream.next(message.sor_pgs_rms_error_tol);
    stream.next(message.contact_surface_layer);
    stream.next(message.contact_max_correcting_vel);
    stream.next(message.cfm);
    stream.next(message.erp);
    stream.next(message.max_contacts);
  }
  ROS_DECLARE_ALLINONE_SERIALIZER
};

template <>
struct Serializer<walker::gazebo::GetPhysicsProperties::Request> {
  template <typename Stream, typename Message>
  static void allInOne(Stream& /*stream*/, Message /*message*/) {}
  ROS_DECLARE_ALLINONE_SERIALIZER
};

template <>
struct Serializer<walker::gazebo::GetPhysicsProperties::Response> {
  template <typename Stream, typename Message>
  static void allInOne(Stream& stream, Message message) {
    stream.next(message.time_step);
    stream.next(message.pause);
    stream.next(message.max_update_rate);
    stream.next(message.gravity);
    stream.next(message.ode_config);
    stream.next(message.success);
    stream.next(message.status_message);
  }
  ROS_DECLARE_ALLINONE_SERIALIZER
};

template <>
struct Serializer<walker::gazebo::SetPhysicsProperties::Request> {
  template <typename Stream, typename Message>
  static void allInOne(Stream& stream, Message message) {
    stream.next(message.time_step);
    stream.next(message.max_update_rate);
    stream.next(message.gravity);
    stream.next(message.ode_config);
  }
  ROS_DECLARE_ALLINONE_SERIALIZER
};

template <>
struct Serializer<walker::gazebo::SetPhysicsProperties::Response> {
  template <typename Stream, typename Message>
  static void allInOne(Stream& stream, Message message) {
    stream.next(message.success);
    stream.next(message.status_message);
  }
  ROS_DECLARE_ALLINONE_SERIALIZER
};

}  // namespace ros::serialization
