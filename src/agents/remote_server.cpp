#include "agents/remote_server.h"

#include <exception>
#include <stdexcept>

#include <ros/console.h>
#include <ros/init.h>
#include <ros/master.h>
#include <ros/this_node.h>

#include "base/printable_text.h"
#include "ros/message_conversions.h"
#include "walker_sim/registry.h"

namespace walker {
namespace {

constexpr double kPause = 0.25;  // between attempts to connect [s]

/// Makes the server's environment here for its complete specification: the server publishes only a
/// part of it.
Specification to_specification(const ServerSpecification& server) {
  if (server.num_envs > 1) {
    throw std::invalid_argument("the server has num_envs = " + std::to_string(server.num_envs) +
                                "; must be 1 for an agent; a client of ~step_batch drives several");
  }
  Specification made;
  try {
    made =
        make(server.id, parameters_of(server.id, server.parameter_names, server.parameter_values))
            ->specification();
  } catch (const Interrupted&) {
    throw;
  } catch (const std::exception& error) {
    throw std::invalid_argument("the server's environment cannot be made here: " +
                                printable(error.what()));
  }
  // The client checks answers against the server's sizes; the agent reads the sizes made here.
  if (server.observation_size != made.observation_size() ||
      server.action_size != made.action_size()) {
    throw std::invalid_argument(
        "the server's " + server.id + " has " + std::to_string(server.observation_size) +
        " observations and " + std::to_string(server.action_size) + " actions; here it has " +
        std::to_string(made.observation_size()) + " and " + std::to_string(made.action_size()));
  }
  return made;
}

bool is_same_environment(const ServerSpecification& a, const ServerSpecification& b) {
  return a.id == b.id && a.num_envs == b.num_envs && a.observation_size == b.observation_size &&
         a.action_size == b.action_size;
}

}  // namespace

RemoteServer::RemoteServer(const ros::NodeHandle& node, const std::string& name) {
  options_.server = node.resolveName(name);
  options_.master_uri = ros::master::getURI();
  options_.caller = ros::this_node::getName();
  options_.is_interrupted = [] { return !ros::ok(); };
}

std::optional<Specification> RemoteServer::specification() {
  if (!wait_for_server()) return std::nullopt;
  return to_specification(*first_specification_);
}

bool RemoteServer::call(const std::function<void(Client&)>& request) {
  if (!wait_for_server()) return false;
  try {
    request(*client_);
    return true;
  } catch (const ConnectionError& error) {
    client_.reset();
    ROS_WARN_STREAM("No answer from " << name() << "; waiting for the server: " << error.what());
    ros::WallDuration(kPause).sleep();
  } catch (const Interrupted&) {
    client_.reset();
  }
  return false;
}

bool RemoteServer::wait_for_server() {
  // On the wall clock: simulation time stands still until the server's first step.
  while (ros::ok() && !client_) {
    try {
      connect();
      break;
    } catch (const ConnectionError& error) {
      if (waiting_reason_ != error.what()) {
        waiting_reason_ = error.what();
        ROS_INFO_STREAM("Waiting for " << name() << ": " << waiting_reason_);
      }
      ros::WallDuration(kPause).sleep();
    } catch (const Interrupted&) {  // the node shuts down
      ros::WallDuration(kPause).sleep();
    }
  }
  return ros::ok();
}

void RemoteServer::connect() {
  auto client = std::make_unique<Client>(options_);
  const ServerSpecification received = client->specification();
  if (!first_specification_) first_specification_ = received;
  if (!is_same_environment(received, *first_specification_)) {
    throw std::runtime_error(
        name() + " was started again with another environment: " + received.id + " after " +
        first_specification_->id + "; start the agent again as well");
  }
  client_ = std::move(client);
  waiting_reason_.clear();
}

}  // namespace walker
