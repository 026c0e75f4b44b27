// The server that an agent drives: waited for, asked what it is, and found again when it was away.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include <ros/node_handle.h>

#include "walker_sim/client.h"
#include "walker_sim/specification.h"

namespace walker {

/// Calls go by our own client, not by roscpp's: it bounds each in time, and takes no length or size
/// of a server's for true.
class RemoteServer {
 public:
  /// @param name of the server's node, relative to the node's namespace
  RemoteServer(const ros::NodeHandle& node, const std::string& name);

  /// Waits for it, however long, and asks.
  /// @return the specification of the same environment made here; none when told to stop
  /// @throws std::invalid_argument when it cannot be made here: this package does not know it, or
  ///         its model file is on the server's machine only; or when the server has several
  std::optional<Specification> specification();

  /// Makes one call, over a connection that stays; where there is none, once it is there again.
  /// @param request makes it; throws as the client's calls do
  /// @return whether it was answered; else it was logged why, unless told to stop
  /// @throws RequestRefused with the server's words; std::runtime_error when the server has become
  ///         another environment's
  bool call(const std::function<void(Client&)>& request);

  const std::string& name() const { return options_.server; }

 private:
  bool wait_for_it();
  bool connect();

  ClientOptions options_;
  std::unique_ptr<Client> client_;               // none: it is away
  std::optional<ServerSpecification> at_first_;  // as it first told
  std::string absence_;                          // why it is away, as was last said
};

}  // namespace walker
