// Gazebo's services of physics properties, mapped to the environment and its schedule.
#pragma once

#include <cstdint>
#include <string>

#include <geometry_msgs/Vector3.h>
#include <ros/serialization.h>
#include <ros/service_traits.h>
#include <std_srvs/Empty.h>
#include <boost/array.hpp>

#include "walker_sim/SetRealTimeFactor.h"
#include "walker_sim/specification.h"

namespace walker {
class Schedule;
}

// The messages do without the package gazebo_msgs: client and server need only the same type name,
// MD5 sum and order of fields.
namespace walker::gazebo {

/// gazebo_msgs/ODEPhysics, as serialized: settings of the engine that Gazebo runs by default. They
/// are ignored in a request and 0 in a response. A flag, two uint32, six float64 and a uint32.
using OdePhysics = boost::array<std::uint8_t, 1 + 2 * 4 + 6 * 8 + 4>;

struct GetPhysicsProperties {
  using Request = std_srvs::Empty::Request;
  struct Response {
    double time_step = 0;            ///< [s]
    std::uint8_t pause = 0;          ///< 1: nothing moves without a service call
    double max_update_rate = 0;      ///< steps per second of wall time; 0: no limit [Hz]
    geometry_msgs::Vector3 gravity;  ///< [m/s^2]
    OdePhysics ode_config{};
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
  struct Request {
    double time_step = 0;            ///< [s]
    double max_update_rate = 0;      ///< as in GetPhysicsProperties [Hz]
    geometry_msgs::Vector3 gravity;  ///< [m/s^2]
    OdePhysics ode_config{};

    template <typename Message, typename Visit>
    static void visit_fields(Message& m, const Visit& visit) {
      visit(m.time_step, m.max_update_rate, m.gravity, m.ode_config);
    }
  };
  using Response = walker_sim::SetRealTimeFactor::Response;  // the same fields
};

/// Returns step, pace, pause and gravity. `set_physics_properties` accepts what it returns.
void get_physics_properties(const Specification& specification, const Schedule& schedule,
                            GetPhysicsProperties::Response& response);

/// Sets the pace. Refuses another step or gravity, which would make another environment under the
/// same id. Ignores ODE's settings, as the response says.
/// @throws std::exception naming the field, its value and what is allowed; then nothing changes
void set_physics_properties(const SetPhysicsProperties::Request& request,
                            const Specification& specification, Schedule& schedule,
                            SetPhysicsProperties::Response& response);

}  // namespace walker::gazebo

namespace ros::service_traits {

template <>
struct DataType<walker::gazebo::GetPhysicsProperties> {
  static const char* value() { return "gazebo_msgs/GetPhysicsProperties"; }
};
template <>
struct MD5Sum<walker::gazebo::GetPhysicsProperties> {
  static const char* value() { return "575a5e74786981b7df2e3afc567693a6"; }
};
template <>
struct DataType<walker::gazebo::SetPhysicsProperties> {
  static const char* value() { return "gazebo_msgs/SetPhysicsProperties"; }
};
template <>
struct MD5Sum<walker::gazebo::SetPhysicsProperties> {
  static const char* value() { return "97e2057080558ce4730434b5fae75c91"; }
};

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
struct Serializer<walker::gazebo::GetPhysicsProperties::Response>
    : FieldSerializer<walker::gazebo::GetPhysicsProperties::Response> {};
template <>
struct Serializer<walker::gazebo::SetPhysicsProperties::Request>
    : FieldSerializer<walker::gazebo::SetPhysicsProperties::Request> {};

}  // namespace ros::serialization
