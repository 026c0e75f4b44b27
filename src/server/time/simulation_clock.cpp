#include "server/time/simulation_clock.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <future>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>

#include <ros/console.h>
#include <ros/master.h>
#include <ros/network.h>
#include <ros/single_subscriber_publisher.h>
#include <ros/this_node.h>
#include <rosgraph_msgs/Clock.h>
#include <xmlrpcpp/XmlRpcClient.h>

#include "server/time/master_calls.h"

namespace walker {
namespace {

constexpr double kNanosecondsPerSecond = 1e9;

// Not below the node's own name: launch files clear what is there.
constexpr const char* kReservedUntil = "/walker_sim_clock/reserved_until";  // [s, ns]
constexpr std::chrono::seconds kMasterTimeout{2};
constexpr std::chrono::seconds kPeerTimeout{3};

/// Asks the master; never waits for one that is gone.
bool ask_master(const std::string& method, const XmlRpc::XmlRpcValue& request,
                XmlRpc::XmlRpcValue& payload) {
  XmlRpc::XmlRpcValue response;
  return ros::master::execute(method, request, response, payload, false);
}

/// A node that was killed stays registered: only one that answers counts.
bool is_alive(const std::string& node) {
  XmlRpc::XmlRpcValue request;
  request[0] = ros::this_node::getName();
  request[1] = node;
  XmlRpc::XmlRpcValue uri;
  if (!ask_master("lookupNode", request, uri)) return false;
  std::string host;
  std::uint32_t port = 0;
  if (!ros::network::splitURI(static_cast<std::string>(uri), host, port)) return false;
  // XmlRpcClient has no timeout of its own, so a peer that hangs is left behind in a thread.
  std::packaged_task<bool()> ask([host, port] {
    XmlRpc::XmlRpcClient client(host.c_str(), static_cast<int>(port), "/");
    XmlRpc::XmlRpcValue caller;
    caller[0] = ros::this_node::getName();
    XmlRpc::XmlRpcValue answer;
    return client.execute("getPid", caller, answer) && answer.valid();
  });
  std::future<bool> answered = ask.get_future();
  std::thread(std::move(ask)).detach();
  return answered.wait_for(kPeerTimeout) == std::future_status::ready && answered.get();
}

/// Another living node that publishes /clock; empty: none.
std::string other_clock_publisher() {
  XmlRpc::XmlRpcValue request;
  request[0] = ros::this_node::getName();
  XmlRpc::XmlRpcValue state;  // [publishers, subscribers, services], each [[name, [nodes]], ...]
  if (!ask_master("getSystemState", request, state)) return "";
  XmlRpc::XmlRpcValue& publishers = state[0];
  for (int i = 0; i < publishers.size(); ++i) {
    if (static_cast<std::string>(publishers[i][0]) != "/clock") continue;
    XmlRpc::XmlRpcValue& nodes = publishers[i][1];
    for (int j = 0; j < nodes.size(); ++j) {
      auto node = static_cast<std::string>(nodes[j]);
      if (node != ros::this_node::getName() && is_alive(node)) return node;
    }
  }
  return "";
}

ros::Time read_reserved() {
  XmlRpc::XmlRpcValue request;
  request[0] = ros::this_node::getName();
  request[1] = kReservedUntil;
  XmlRpc::XmlRpcValue value;
  const bool found = ask_master("getParam", request, value) &&
                     value.getType() == XmlRpc::XmlRpcValue::TypeArray && value.size() == 2 &&
                     value[0].getType() == XmlRpc::XmlRpcValue::TypeInt &&
                     value[1].getType() == XmlRpc::XmlRpcValue::TypeInt;
  if (!found) return {};
  return {static_cast<std::uint32_t>(static_cast<int>(value[0])),
          static_cast<std::uint32_t>(static_cast<int>(value[1]))};
}

/// @param caller name of this node
/// @param time   [ns]
void write_reserved(const std::string& uri, const std::string& caller, std::uint64_t time) {
  const ros::Time until = ros::Time().fromNSec(time);
  const auto integer = [](std::uint32_t value) {  // XML-RPC has signed ones alone
    return "<value><i4>" + std::to_string(static_cast<std::int32_t>(value)) + "</i4></value>";
  };
  const std::string call =
      "<?xml version=\"1.0\"?>\n<methodCall><methodName>setParam</methodName><params>"
      "<param><value><string>" +
      caller + "</string></value></param><param><value><string>" + kReservedUntil +
      "</string></value></param><param><value><array><data>" + integer(until.sec) +
      integer(until.nsec) + "</data></array></value></param></params></methodCall>\n";
  call_master(uri, call, kMasterTimeout);
}

/// ROS time that there is after `time` [ns].
std::uint64_t left_after(ros::Time time) { return ros::TIME_MAX.toNSec() - time.toNSec(); }

/// In whole nanoseconds.
ros::Duration to_duration(double seconds) {
  constexpr double kEnd = 2147483648;  // 2^31
  if (seconds >= kEnd) {
    throw std::invalid_argument("dt = " + std::to_string(seconds) +
                                " s; must be below 2^31 s, where durations in ROS end");
  }
  ros::Duration duration;
  duration.fromNSec(std::llround(seconds * kNanosecondsPerSecond));
  return duration;
}

}  // namespace

SimulationClock SimulationClock::owner(ros::NodeHandle& node, double dt) { return {node, dt}; }

SimulationClock SimulationClock::silent(double dt) { return SimulationClock(dt); }

SimulationClock::SimulationClock(double dt) : dt_(to_duration(dt)) {}

SimulationClock::SimulationClock(ros::NodeHandle& node, double dt) : SimulationClock(dt) {
  // Who joins between two lock-steps would otherwise wait for a time that does not come. Latching
  // would tell it too, but ahead of messages still queued: time would run backwards for it.
  const auto tell_newcomer = [this](const ros::SingleSubscriberPublisher&) { publish(); };
  publisher_ = node.advertise<rosgraph_msgs::Clock>("/clock", 10, tell_newcomer);
  // Looked for after advertising, so that of two servers that start together at least one sees the
  // other.
  const std::string other = other_clock_publisher();
  if (!other.empty()) {
    throw std::runtime_error("/clock is published by " + other +
                             " already; set publish_clock = false to follow it");
  }
  now_ = read_reserved();
  reservation_ = std::make_unique<TimeReservation>(
      now_.toNSec(), ros::TIME_MAX.toNSec(),
      [uri = ros::master::getURI(), caller = ros::this_node::getName()](std::uint64_t until) {
        write_reserved(uri, caller, until);
      });
}

void SimulationClock::require(int steps) const {
  if (static_cast<std::uint64_t>(steps * dt_.toNSec()) <= left_after(now_)) return;
  throw std::range_error("simulation time " + std::to_string(now_.toSec()) +
                         " s is at the end of ROS time, 2^32 s, so nothing can follow; begin again "
                         "with a new ROS master");
}

void SimulationClock::advance() {
  require();
  now_ += dt_;
  if (!publisher_) return;
  reservation_->use(now_.toNSec());
  publish();
}

void SimulationClock::catch_up(ros::Time time) { now_ = std::max(now_, time); }

void SimulationClock::publish() {
  rosgraph_msgs::Clock message;
  message.clock = now_;
  publisher_.publish(message);
}

}  // namespace walker
