#include "client/master.h"

#include <charconv>
#include <limits>
#include <stdexcept>

#include "client/http.h"
#include "client/service_types.h"
#include "client/xml_rpc.h"
#include "walker_sim/client.h"

namespace walker {
namespace {

/// What the master says of the service: its URI.
/// @throws SocketError, Interrupted; std::runtime_error saying what is wrong with the answer
std::string service_uri(const Endpoint& master, const std::string& name, const Patience& patience) {
  const std::string call = xml_rpc::make_call("lookupService", {kCallerId, name});
  const xml_rpc::Value answer =
      xml_rpc::parse_answer(http_post(master.host, master.port, call, patience));
  // [code, text, URI]: 1 success, 0 failure, -1 error of the caller
  using Kind = xml_rpc::Value::Kind;
  if (answer.kind != Kind::array || answer.elements.size() != 3 ||
      answer.elements[0].kind != Kind::integer || answer.elements[1].kind != Kind::text) {
    throw std::runtime_error("its answer to lookupService is not [code, text, URI]");
  }
  if (answer.elements[0].integer != 1) {
    throw std::runtime_error("it does not know " + name + " (" + answer.elements[1].text +
                             "): is the server running, under this name, and in a "
                             "version that has this service?");
  }
  return answer.elements[2].text;
}

}  // namespace

Endpoint parse_uri(const std::string& uri, const std::string& scheme) {
  const std::string prefix = scheme + "://";
  const auto fail = [&] {
    throw std::invalid_argument("\"" + uri + "\"; must be " + prefix + "HOST:PORT");
  };
  if (uri.compare(0, prefix.size(), prefix) != 0) fail();
  std::string address = uri.substr(prefix.size());
  if (!address.empty() && address.back() == '/') address.pop_back();
  const std::size_t colon = address.rfind(':');
  if (colon == std::string::npos || colon == 0) fail();
  Endpoint endpoint;
  endpoint.host = address.substr(0, colon);
  if (endpoint.host.front() == '[' && endpoint.host.back() == ']') {
    endpoint.host = endpoint.host.substr(1, endpoint.host.size() - 2);
  }
  if (endpoint.host.empty() || endpoint.host.find_first_of("/[]@ \t\r\n") != std::string::npos) {
    fail();
  }
  const char* const begin = address.data() + colon + 1;
  const char* const end = address.data() + address.size();
  const auto [stop, error] = std::from_chars(begin, end, endpoint.port);
  if (error != std::errc() || stop != end || endpoint.port == 0) fail();
  return endpoint;
}

Endpoint look_up_service(const std::string& master_uri, const std::string& name,
                         const Patience& patience) {
  const std::string whom = "ROS master " + master_uri + ": ";
  const Endpoint master = parse_uri(master_uri, "http");
  try {
    return parse_uri(service_uri(master, name, patience), "rosrpc");
  } catch (const SocketError& error) {
    throw ConnectionError(whom + error.what() + "; is it running, and is this its ROS_MASTER_URI?");
  } catch (const Interrupted&) {
    throw;
  } catch (const std::exception& error) {
    throw ConnectionError(whom + error.what());
  }
}

}  // namespace walker
