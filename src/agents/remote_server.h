// An agent's connection to its server, which waits for the server and reconnects.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include <ros/node_handle.h>

#include "walker_sim/client.h"
#include "walker_sim/specification.h"

namespace walker {

/// Uses walker::Client instead of roscpp's service client: it has a timeout for every call, and
/// checks all lengths and sizes in answers.
class RemoteServer {
 public:
  /// @param name of the server's node, relative to this node's namespace
  RemoteServer(const ros::NodeHandle& node, const std::string& name);

  /// Blocks until the server answers, without a timeout.
  /// @return the specification of the same environment made here; none if the node shuts down
  /// @throws std::invalid_argument if the environment cannot be made here (unknown id, or a model
  ///         file on the server's machine only), has other sizes here, or is one of several
  std::optional<Specification> specification();

  /// Makes one call over a persistent connection. Blocks until there is a connection.
  /// @param request makes the call; throws as the client's methods do
  /// @return whether the server answered; if not, the reason is logged unless the node shuts down
  /// @throws RequestRefused with the server's message; std::runtime_error if the server was
  ///         restarted with another environment
  bool call(const std::function<void(Client&)>& request);

  const std::string& name() const { return options_.server; }

  /// The server's world at the first connection; empty: Gymnasium's, or not connected yet.
  World world() const { return first_specification_ ? first_specification_->world : World{}; }

 private:
  bool wait_for_server();
  void connect();

  ClientOptions options_;
  std::unique_ptr<Client> client_;                          // null: not connected
  std::optional<ServerSpecification> first_specification_;  // of the first connection
  std::string waiting_reason_;  // last logged reason for not being connected
};

}  // namespace walker
