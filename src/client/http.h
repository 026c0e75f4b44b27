// HTTP/1.1 as far as a call of a ROS master needs it.
#pragma once

#include <cstdint>
#include <string>

#include "client/socket.h"

namespace walker {

/// Posts `body`, an XML text, to the root of a server on a connection of its own.
/// @return the answer's body: of a declared length, in chunks, or up to the connection's end
/// @throws SocketError, Interrupted; std::runtime_error saying what is wrong with the answer
std::string http_post(const std::string& host, std::uint16_t port, const std::string& body,
                      const Patience& patience);

}  // namespace walker
