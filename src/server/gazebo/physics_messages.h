// gazebo_msgs' services of physics properties, without that package: client and server need only
// the same type name, MD5 sum and order of fields.
#pragma once

#include <cstdint>
#include <string>

#include <geometry_msgs/Vector3.h>
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

  template <typename Message, typename Visit>
  static void visit_fields(Message& m, const Visit& visit) {
    visit(m.auto_disable_bodies, m.sor_pgs_precon_iters, m.sor_pgs_iters, m.sor_pgs_w,
          m.sor_pgs_rms_error_tol, m.contact_surface_layer, m.contact_max_correcting_vel, m.cfm,
          m.erp, m.max_contacts);
  }
};

struct GetPhysicsProperties {
  static constexpr const char* kType = "gazebo_msgs/GetPhysicsProperties";
  static constexpr const char* kMd5Sum = "575a5e74786981b7df2e3afc567693a6";

  struct Request {
    template <typename Message, typename Visit>
    static void visit_fields(Message& /*m*/, const Visit& visit) {
      visit();
    }
  };
  struct Response {
    double time_step = 0;            ///< [s]
    std::uint8_t pause = 0;          ///< 1: nothing moves without a service call
    double max_update_rate = 0;      ///< steps per second of wall time; 0: no limit [Hz]
    geometry_msgs::Vector3 gravity;  ///< [m/s^2]
    OdePhysics ode_config;
    std::uint8_t success = 0;
    std::string status_message;

    template <typename Message, typename Visit>
    static void visit_fields(Message& m, const Visit& visit) {
      visit(m.time_step, m.pause, m.max_update_rate, m.gravity, m.ode_config, m.success,
            m.status_message);
    }
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

    template <typename Message, typename Visit>
    static void visit_fields(Message& m, const Visit& visit) {
      visit(m.time_step, m.max_update_rate, m.gravity, m.ode_config);
    }
  };
  struct Response {
    std::uint8_t success = 0;
    std::string status_message;

    template <typename Message, typename Visit>
    static void visit_fields(Message& m, const Visit& visit) {
      visit(m.success, m.status_message);
    }
  };
};

template <typename Service>
struct ServiceType {
  static const char* value() { return Service::kType; }
};

template <typename Service>
struct ServiceMd5Sum {
  static const char* value() { return Service::kMd5Sum; }
};

}  // namespace walker::gazebo

// ---------------------------------------------------------------- traits that roscpp requires

namespace ros::service_traits {

template <>
struct DataType<walker::gazebo::GetPhysicsProperties>
    : walker::gazebo::ServiceType<walker::gazebo::GetPhysicsProperties> {};
template <>
struct MD5Sum<walker::gazebo::GetPhysicsProperties>
    : walker::gazebo::ServiceMd5Sum<walker::gazebo::GetPhysicsProperties> {};
template <>
struct DataType<walker::gazebo::SetPhysicsProperties>
    : walker::gazebo::ServiceType<walker::gazebo::SetPhysicsProperties> {};
template <>
struct MD5Sum<walker::gazebo::SetPhysicsProperties>
    : walker::gazebo::ServiceMd5Sum<walker::gazebo::SetPhysicsProperties> {};

}  // namespace ros::service_traits

namespace ros::serialization {

/// Serializes the fields of a message in the order of `visit_fields`.
template <typename Fields>
struct FieldSerializer {
  template <typename Stream, typename Message>
  static void allInOne(Stream& stream, Message message) {
    Fields::visit_fields(message, [&stream](auto&... fields) { (stream.next(fields), ...); });
  }
  ROS_DECLARE_ALLINONE_SERIALIZER
};

template <>
struct Serializer<walker::gazebo::OdePhysics> : FieldSerializer<walker::gazebo::OdePhysics> {};
template <>
struct Serializer<walker::gazebo::GetPhysicsProperties::Request>
    : FieldSerializer<walker::gazebo::GetPhysicsProperties::Request> {};
template <>
struct Serializer<walker::gazebo::GetPhysicsProperties::Response>
    : FieldSerializer<walker::gazebo::GetPhysicsProperties::Response> {};
template <>
struct Serializer<walker::gazebo::SetPhysicsProperties::Request>
    : FieldSerializer<walker::gazebo::SetPhysicsProperties::Request> {};
template <>
struct Serializer<walker::gazebo::SetPhysicsProperties::Response>
    : FieldSerializer<walker::gazebo::SetPhysicsProperties::Response> {};

}  // namespace ros::serialization
