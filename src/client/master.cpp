#include "client/master.h"

#include <charconv>
#include <limits>
#include <utility>

#include "client/http.h"
#include "client/service_types.h"
#include "walker_sim/client.h"

namespace walker {

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

xml_rpc::Value call_master(const std::string& uri, const std::string& call,
                           const Patience& patience, const char* malformed) {
  const Endpoint master = parse_uri(uri, "http");
  xml_rpc::Value answer =
      xml_rpc::parse_answer(http_post(master.host, master.port, call, patience));
  // [code, text, value]: 1 success, 0 failure, -1 error of the caller
  using Kind = xml_rpc::Value::Kind;
  if (answer.kind != Kind::array || answer.elements.size() != 3 ||
      answer.elements[0].kind != Kind::integer || answer.elements[1].kind != Kind::text) {
    throw std::runtime_error(malformed);
  }
  if (answer.elements[0].integer != 1) throw MasterRefusal(answer.elements[1].text);
  return std::move(answer.elements[2]);
}

Endpoint look_up_service(const std::string& master_uri, const std::string& name,
                         const Patience& patience) {
  const std::string whom = "ROS master " + master_uri + ": ";
  try {
    const xml_rpc::Value uri =
        call_master(master_uri, xml_rpc::make_call("lookupService", {kCallerId, name}), patience,
                    "its answer to lookupService is not [code, text, URI]");
    return parse_uri(uri.text, "rosrpc");
  } catch (const MasterRefusal& refusal) {
    throw ConnectionError(whom + "it does not know " + name + " (" + refusal.what() +
                          "): is the server running, under this name, and in a version that has "
                          "this service?");
  } catch (const SocketError& error) {
    throw ConnectionError(whom + error.what() + "; is it running, and is this its ROS_MASTER_URI?");
  } catch (const Interrupted&) {
    throw;
  } catch (const std::exception& error) {
    throw ConnectionError(whom + error.what());
  }
}

}  // namespace walker
