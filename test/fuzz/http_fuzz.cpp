// A master's HTTP response, the XML-RPC in it, and the service's address in that.
#include <string>

#include "fuzz/scripted_socket.h"
#include "fuzz/target.h"
#include "walker_sim/client.h"
#include "wire/master.h"

namespace walker::fuzz {
namespace {

void run(const std::uint8_t* data, std::size_t size) {
  script() = {{data, data + size}};
  try {
    const Endpoint endpoint =
        look_up_service("http://localhost:11311", "/walker_sim/step", Deadline(TimePoint::max()));
    require(endpoint.port != 0 && !endpoint.host.empty(), "an address has a host and a port");
  } catch (const ConnectionError& refusal) {
    accept(refusal);
  }
}

const Registered kTarget("http", run);

}  // namespace
}  // namespace walker::fuzz
