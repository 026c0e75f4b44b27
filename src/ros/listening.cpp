#include "ros/listening.h"

#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>

#include <ros/network.h>

namespace walker {
namespace {

/// Returns "NAME = VALUE" of the variable that sets the node's host name; empty if none does.
std::string name_variable() {
  for (const char* name : {"ROS_HOSTNAME", "ROS_IP"}) {
    const char* value = std::getenv(name);
    if (value != nullptr) return std::string(name) + " = " + value;
  }
  return {};
}

/// Returns whether ROS_HOSTNAME or ROS_IP restricts this node to the loopback interface: localhost,
/// ::1 or 127.*, as in roscpp's `Transport` and rospy's `get_bind_address`. If neither is set, ROS
/// uses the machine's host name, and a node listens on every address.
bool is_loopback_only() {
  const std::string& host = ros::network::getHost();
  return host == "localhost" || host == "::1" || host.rfind("127.", 0) == 0;
}

template <typename Address>
int bind_to(int descriptor, const Address& address) {
  return static_cast<int>(syscall(SYS_bind, descriptor, &address, sizeof(address)));
}

}  // namespace

std::string listening_addresses() {
  const std::string variable = name_variable();
  if (is_loopback_only()) {
    return "Listens on this machine alone" + (variable.empty() ? "" : " (" + variable + ")");
  }
  return "Listens on every address of this machine, as " + ros::network::getHost() + " (" +
         (variable.empty() ? "ROS_HOSTNAME and ROS_IP are not set" : variable) +
         "): any client that reaches it can command it; ROS_HOSTNAME=localhost keeps it here";
}

}  // namespace walker

// Replaces the C library's bind() in the nodes. roscpp binds its XML-RPC port to every address
// whatever ROS_HOSTNAME is, has no parameter for that, and registers the port with the master
// before it could be bound again.
// NOLINTNEXTLINE(readability-inconsistent-declaration-parameter-name): those there are reserved
extern "C" __attribute__((visibility("default"))) int bind(int descriptor, const sockaddr* address,
                                                           socklen_t size) noexcept {
  if (walker::is_loopback_only()) {
    sockaddr_in ipv4{};
    sockaddr_in6 ipv6{};
    if (address->sa_family == AF_INET && size >= sizeof(ipv4)) {
      std::memcpy(&ipv4, address, sizeof(ipv4));
      if (ipv4.sin_addr.s_addr == htonl(INADDR_ANY)) {
        ipv4.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        return walker::bind_to(descriptor, ipv4);
      }
    } else if (address->sa_family == AF_INET6 && size >= sizeof(ipv6)) {
      std::memcpy(&ipv6, address, sizeof(ipv6));
      if (IN6_IS_ADDR_UNSPECIFIED(&ipv6.sin6_addr)) {
        ipv6.sin6_addr = in6addr_loopback;
        return walker::bind_to(descriptor, ipv6);
      }
    }
  }
  return static_cast<int>(syscall(SYS_bind, descriptor, address, size));
}
