#include "server/time/simulation_clock.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <vector>

#include <ros/console.h>
#include <ros/master.h>
#include <ros/single_subscriber_publisher.h>
#include <ros/this_node.h>
#include <rosgraph_msgs/Clock.h>

#include "base/shortest_text.h"
#include "ros/node_main.h"
#include "wire/master.h"
#include "wire/socket.h"

namespace walker {
namespace {

using xml_rpc::Value;
using Clock = std::chrono::steady_clock;

constexpr std::chrono::seconds kPeerTimeout{3};
// Half of ROS time. At full speed a server does not reach it within a month.
constexpr std::uint32_t kLate = 2147483648U;  // [s]

/// Calls a method of the master, or of the node at `uri`, with this node's name first; none if that
/// fails.
std::optional<Value> ask(const std::string& method, std::vector<std::string> arguments = {},
                         const std::string& uri = ros::master::getURI(),
                         std::chrono::seconds longest = kMasterTimeout) {
  arguments.insert(arguments.begin(), ros::this_node::getName());
  try {
    return call_master(uri, xml_rpc::make_call(method, arguments),
                       Deadline(Clock::now() + longest));
  } catch (const std::exception&) {
    return std::nullopt;
  }
}

/// Whether the node answers: a killed node stays registered.
bool is_alive(const std::string& node) {
  const std::optional<Value> uri = ask("lookupNode", {node});
  return uri && ask("getPid", {}, uri->text, kPeerTimeout);
}

/// Name of another running node that publishes /clock; empty if none.
std::string other_clock_publisher() {
  // [publishers, subscribers, services], each [[name, [nodes]], ...]
  const std::optional<Value> state = ask("getSystemState");
  if (!state) return "";
  try {
    for (const Value& publisher : state->elements.at(0).elements) {
      if (publisher.elements.at(0).text != "/clock") continue;
      for (const Value& node : publisher.elements.at(1).elements) {
        if (node.text != ros::this_node::getName() && is_alive(node.text)) return node.text;
      }
    }
  } catch (const std::out_of_range&) {
    return "";  // malformed answer
  }
  return "";
}

/// End of the time reserved on this master [ns]; 0 if unset or if the master does not answer.
/// @throws std::exception naming the parameter and what is wrong with it
std::uint64_t read_reserved() {
  const std::string call =
      xml_rpc::make_call("getParam", {ros::this_node::getName(), kReservedUntil});
  Value value;
  try {
    value = call_master(ros::master::getURI(), call, Deadline(Clock::now() + kMasterTimeout));
  } catch (const MasterRefusal&) {
    return 0;  // it is not set
  } catch (const SocketError&) {
    return 0;
  } catch (const std::exception& error) {  // an unsupported type, such as a date
    throw std::runtime_error(std::string("parameter ") + kReservedUntil +
                             ": the ROS master's answer cannot be read: " + error.what());
  }
  return read_reserved_until(value);
}

/// Sets `kReservedUntil` to `time` [ns]. @throws std::exception if the master does not accept it
void write_reserved(const std::string& uri, const std::string& caller, std::uint64_t time) {
  const std::string call =
      xml_rpc::make_call("setParam", {caller, kReservedUntil}, to_reserved_until(time));
  call_master(uri, call, Deadline(Clock::now() + kMasterTimeout));
}

/// Rounds to nanoseconds.
ros::Duration to_duration(double seconds) {
  constexpr double kEnd = 2147483648;  // 2^31
  if (seconds >= kEnd) {
    throw std::invalid_argument("dt = " + fixed_text(seconds) +
                                " s; must be below 2^31 s, the limit of a duration in ROS");
  }
  return ros::Duration().fromNSec(std::llround(seconds * 1e9));
}

}  // namespace

SimulationClock::SimulationClock(double dt) : dt_(to_duration(dt)) {}

SimulationClock::SimulationClock(ros::NodeHandle& node, double dt) : SimulationClock(dt) {
  // Otherwise a subscriber that connects between two lock-steps would wait for the next one. A
  // latched message would overtake queued ones, so time would run backwards for the subscriber.
  const auto publish_to_new_subscriber = [this](const ros::SingleSubscriberPublisher&) {
    publish_again();
  };
  publisher_ = node.advertise<rosgraph_msgs::Clock>("/clock", 10, publish_to_new_subscriber);
  // Checked after advertising: of two servers that start together, at least one sees the other.
  const std::string other = other_clock_publisher();
  if (!other.empty()) {
    throw std::runtime_error("/clock is published by " + other +
                             " already; set publish_clock = false to follow it");
  }
  now_.fromNSec(read_reserved());
  if (now_.sec >= kLate) {
    ROS_WARN_STREAM("Simulation time begins at " << now_ << " s, the value of the parameter "
                                                 << kReservedUntil);
  }
  reservation_ = std::make_unique<TimeReservation>(
      now_.toNSec(), ros::TIME_MAX.toNSec(),
      [uri = ros::master::getURI(), caller = ros::this_node::getName()](std::uint64_t until) {
        write_reserved(uri, caller, until);
      });
}

void SimulationClock::require(int steps) const {
  const std::uint64_t left = ros::TIME_MAX.toNSec() - now_.toNSec();
  if (static_cast<std::uint64_t>(steps * dt_.toNSec()) <= left) return;
  throw std::range_error("simulation time " + fixed_text(now_.toSec()) +
                         " s is at the end of ROS time, 2^32 s; to begin again at 0, start a new "
                         "ROS master");
}

void SimulationClock::advance() {
  require();
  now_ += dt_;
  is_published_ = false;
  if (!publisher_) return;
  reservation_->use(now_.toNSec());
  set_time(now_);
}

void SimulationClock::publish() {
  if (publisher_ && !is_published_) publish_again();
}

void SimulationClock::catch_up(ros::Time time) { now_ = std::max(now_, time); }

void SimulationClock::publish_again() {
  is_published_ = true;
  rosgraph_msgs::Clock message;
  message.clock = now_;
  publisher_.publish(message);
}

}  // namespace walker
