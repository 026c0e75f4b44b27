// Calls of the ROS master, and where the services that it knows are to be found.
// Source: wiki.ros.org/ROS/Master_API.
#pragma once

#include <chrono>
#include <cstdint>
#include <stdexcept>
#include <string>

#include "wire/socket.h"
#include "wire/xml_rpc.h"

namespace walker {

/// Name under which this package's clients call a master. They register nowhere.
constexpr const char* kCallerId = "/walker_sim_client";

/// How long a node waits for the master's answer to one call.
constexpr std::chrono::seconds kMasterTimeout{2};

/// Where something listens.
struct Endpoint {
  std::string host;
  std::uint16_t port = 0;

  std::string text() const { return host + ":" + std::to_string(port); }
};

/// @param uri    e.g. http://localhost:11311/; an IPv6 address stands in brackets, or bare
/// @param scheme that it must have, e.g. http
/// @throws std::invalid_argument saying what it must be
Endpoint parse_uri(const std::string& uri, const std::string& scheme);

/// A master has answered that it will not, or cannot; the message is its own.
struct MasterRefusal : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Makes a call of a master or, with the same form of answers, of a node. It comes to an end, which
/// ros::master::execute does not where a master hangs: one that is stopped, or a machine that is
/// lost.
/// @param uri       of whom is called
/// @param call      an XML-RPC text
/// @param malformed what is said of an answer that has another form
/// @return what comes with its success
/// @throws MasterRefusal; SocketError, Interrupted; std::exception that says what is wrong with the
///         URI or with the answer
xml_rpc::Value call_master(const std::string& uri, const std::string& call,
                           const Deadline& deadline,
                           const char* malformed = "its answer is not [code, text, value]");

/// Asks a master who provides a service.
/// @param name of the service, resolved
/// @throws ConnectionError naming the master, the service and the cause; Interrupted
Endpoint look_up_service(const std::string& master_uri, const std::string& name,
                         const Deadline& deadline);

}  // namespace walker
