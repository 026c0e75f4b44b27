// Calls of the ROS master, and lookup of services.
// Source: wiki.ros.org/ROS/Master_API.
#pragma once

#include <chrono>
#include <cstdint>
#include <stdexcept>
#include <string>

#include "wire/socket.h"
#include "wire/xml_rpc.h"

namespace walker {

/// Caller id of this package's clients in calls of a master, with which they do not register.
constexpr const char* kCallerId = "/walker_sim_client";

/// Timeout of a node's call of the master.
constexpr std::chrono::seconds kMasterTimeout{2};

struct Endpoint {
  std::string host;
  std::uint16_t port = 0;

  std::string text() const { return host + ":" + std::to_string(port); }
};

/// @param uri    e.g. http://localhost:11311/; brackets around an IPv6 address are optional
/// @param scheme required scheme, e.g. http
/// @throws std::invalid_argument unless `uri` is SCHEME://HOST:PORT
Endpoint parse_uri(const std::string& uri, const std::string& scheme);

/// The master answered with failure or error; the message is the master's.
struct MasterRefusal : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Calls a master, or a node, whose answers have the same form. Unlike ros::master::execute it
/// returns at the deadline if the master hangs: is stopped, or on a machine that is lost.
/// @param uri       of the master or node
/// @param call      XML-RPC request
/// @param malformed error message for an answer of another form
/// @return the answer's value
/// @throws MasterRefusal; SocketError, Interrupted; another std::exception for an invalid URI, a
///         malformed answer or a fault
xml_rpc::Value call_master(const std::string& uri, const std::string& call,
                           const Deadline& deadline,
                           const char* malformed = "its answer is not [code, text, value]");

/// Asks a master for a service's address.
/// @param name resolved name of the service
/// @throws ConnectionError naming the master, the service and the cause; Interrupted
Endpoint look_up_service(const std::string& master_uri, const std::string& name,
                         const Deadline& deadline);

}  // namespace walker
