// Where the ROS master and the services that it knows are to be found.
// Source: wiki.ros.org/ROS/Master_API.
#pragma once

#include <cstdint>
#include <string>

#include "client/socket.h"

namespace walker {

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

/// Asks a master who provides a service.
/// @param name of the service, resolved
/// @throws ConnectionError naming the master, the service and the cause; Interrupted
Endpoint look_up_service(const std::string& master_uri, const std::string& name,
                         const Patience& patience);

}  // namespace walker
