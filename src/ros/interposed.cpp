#include "ros/interposed.h"

#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <map>
#include <stdexcept>

#include <ros/console.h>
#include <ros/console_impl.h>
#include <ros/network.h>
#include <xmlrpcpp/XmlRpcException.h>
#include <xmlrpcpp/XmlRpcServerConnection.h>
#include <xmlrpcpp/XmlRpcValue.h>

namespace walker {
namespace {

using XmlRpc::XmlRpcValue;

std::size_t count(const std::string& text, const std::string& part) {
  std::size_t found = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) {
    ++found;
  }
  return found;
}

/// Bounds a request's nesting depth, since XmlRpc++ parses it recursively.
void check_depth(const std::string& request) {
  constexpr std::size_t kMaxLists = 100;  // bounds the depth; roscpp's own calls need 4
  const std::size_t lists = count(request, "<array>") + count(request, "<struct>");
  if (lists > kMaxLists) {
    throw std::invalid_argument(std::to_string(lists) + " lists in a request: must be at most " +
                                std::to_string(kMaxLists));
  }
}

/// Rejects a nested multicall, for which XmlRpc++ would execute the outer one again, recursively.
void check_multicall(XmlRpcValue& parameters, const std::string& multicall,
                     const std::string& member) {
  if (parameters.getType() != XmlRpcValue::TypeArray || parameters.size() == 0) return;
  XmlRpcValue& calls = parameters[0];
  if (calls.getType() != XmlRpcValue::TypeArray) return;
  for (int i = 0; i < calls.size(); ++i) {
    if (calls[i].hasMember(member) && calls[i][member] == XmlRpcValue(multicall)) {
      throw std::invalid_argument(multicall + ": must not be within another");
    }
  }
}

/// Checks the datagram size of a UDPROS request: roscpp divides by the size of the payload.
void check_datagrams(XmlRpcValue& parameters) {
  constexpr int kMinBytes = 64;
  constexpr int kMaxBytes = 65507;  // UDP payload over IPv4
  constexpr int kSizeField = 4;
  if (parameters.getType() != XmlRpcValue::TypeArray || parameters.size() < 3) return;
  XmlRpcValue& protocols = parameters[2];
  if (protocols.getType() != XmlRpcValue::TypeArray) return;
  for (int i = 0; i < protocols.size(); ++i) {
    XmlRpcValue& protocol = protocols[i];
    if (protocol.getType() != XmlRpcValue::TypeArray || protocol.size() <= kSizeField) continue;
    if (protocol[kSizeField].getType() != XmlRpcValue::TypeInt) continue;
    const int bytes = protocol[kSizeField];
    if (bytes < kMinBytes || bytes > kMaxBytes) {
      throw std::invalid_argument("datagrams of " + std::to_string(bytes) +
                                  " bytes: must be from " + std::to_string(kMinBytes) + " to " +
                                  std::to_string(kMaxBytes));
    }
  }
}

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

namespace ros::console {

// Replaces rosconsole's. Debian 12's version puts log4cxx's logger repository, a plain pointer,
// into a shared pointer, which deletes it: every later use of a logger reads freed memory.
bool get_loggers(std::map<std::string, levels::Level>& loggers) {
  for (const char* name : {"ros", "ros.roscpp", "ros.roscpp.roscpp_internal",
                           "ros.roscpp.superdebug", ROSCONSOLE_DEFAULT_NAME}) {
    void* const logger = impl::getHandle(name);
    int level = levels::Debug;
    while (level < levels::Fatal &&
           !impl::isEnabledFor(logger, static_cast<levels::Level>(level))) {
      ++level;
    }
    loggers[name] = static_cast<levels::Level>(level);
  }
  return true;
}

}  // namespace ros::console

namespace XmlRpc {

// Replaces XmlRpc++'s, which catches only XmlRpcException, so that any other exception terminates
// the process: paramUpdate with an invalid name throws ros::InvalidNameException.
void XmlRpcServerConnection::executeRequest() {
  try {
    walker::check_depth(_request);
    XmlRpcValue parameters;
    XmlRpcValue result;
    const std::string method = parseRequest(parameters);
    if (method == SYSTEM_MULTICALL) walker::check_multicall(parameters, method, METHODNAME);
    if (method == "requestTopic") walker::check_datagrams(parameters);
    if (executeMethod(method, parameters, result) || executeMulticall(method, parameters, result)) {
      generateResponse(result.toXml());
    } else {
      generateFaultResponse(method + ": unknown method name");
    }
  } catch (const XmlRpcException& fault) {
    generateFaultResponse(fault.getMessage(), fault.getCode());
  } catch (const std::exception& error) {
    generateFaultResponse(error.what());
  }
}

}  // namespace XmlRpc

// Replaces the C library's bind() in the nodes. roscpp binds its XML-RPC port to every address
// whatever ROS_HOSTNAME is, has no parameter for that, and registers the port with the master
// before it could be bound again.
// NOLINTNEXTLINE(readability-inconsistent-declaration-parameter-name): those there are reserved
extern "C" __attribute__((visibility("default"))) int bind(int descriptor, const sockaddr* address,
                                                           socklen_t size) noexcept {
  union {
    sockaddr_in6 ipv6;
    sockaddr_in ipv4;
  } copy{};
  if (walker::is_loopback_only()) {
    const socklen_t copied = std::min<socklen_t>(size, sizeof(copy));
    std::memcpy(&copy, address, copied);
    if (address->sa_family == AF_INET && copy.ipv4.sin_addr.s_addr == htonl(INADDR_ANY)) {
      copy.ipv4.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
      address = reinterpret_cast<const sockaddr*>(&copy);
      size = copied;
    } else if (address->sa_family == AF_INET6 && IN6_IS_ADDR_UNSPECIFIED(&copy.ipv6.sin6_addr)) {
      copy.ipv6.sin6_addr = in6addr_loopback;
      address = reinterpret_cast<const sockaddr*>(&copy);
      size = copied;
    }
  }
  return static_cast<int>(syscall(SYS_bind, descriptor, address, size));
}
