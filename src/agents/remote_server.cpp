#include "agents/remote_server.h"

#include <exception>
#include <stdexcept>

#include <ros/console.h>
#include <ros/init.h>
#include <ros/master.h>
#include <ros/this_node.h>

#include "base/printable_text.h"
#include "ros/records.h"
#include "walker_sim/registry.h"

namespace walker {
namespace {

constexpr double kPause = 0.25;  // between attempts to connect [s]

/// Makes the server's environment here for its complete specification: the server publishes only a
/// part of it.
Specification to_specification(const ServerSpecification& told) {
  if (told.num_envs > 1) {
    throw std::invalid_argument("the server has num_envs = " + std::to_string(told.num_envs) +
                                "; an agent drives 1, and several are driven by ~step_batch");
  }
  Specification made;
  try {
    made = make(told.id, parameters_of(told.id, told.parameter_names, told.parameter_values))
               ->specification();
  } catch (const Interrupted&) {
    throw;
  } catch (const std::exception& error) {
    throw std::invalid_argument("the server's environment cannot be made here: " +
                                printable(error.what()));
  }
  // The client checks answers against the server's sizes; the agent reads the sizes made here.
  if (told.observation_size != made.observation_size() || told.action_size != made.action_size()) {
    throw std::invalid_argument(
        "the server's " + told.id + " has " + std::to_string(told.observation_size) +
        " observations and " + std::to_string(told.action_size) + " actions; here it has " +
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
  if (!wait_for_it()) return std::nullopt;
  return to_specification(*at_first_);
}

bool RemoteServer::call(const std::function<void(Client&)>& request) {
  if (!wait_for_it()) return false;
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

bool RemoteServer::wait_for_it() {
  // On the wall clock: simulation time stands still until the server's first step.
  while (ros::ok() && !client_ && !connect()) ros::WallDuration(kPause).sleep();
  return ros::ok();
}

/// @return whether the server is connected
bool RemoteServer::connect() {
  try {
    auto client = std::make_unique<Client>(options_);
    const ServerSpecification told = client->specification();
    if (!at_first_) at_first_ = told;
    if (!is_same_environment(told, *at_first_)) {
      throw std::runtime_error(name() + " was started again with another environment: " + told.id +
                               " after " + at_first_->id + "; start the agent again as well");
    }
    client_ = std::move(client);
    absence_.clear();
    return true;
  } catch (const ConnectionError& error) {
    if (absence_ != error.what()) {
      absence_ = error.what();
      ROS_INFO_STREAM("Waiting for " << name() << ": " << absence_);
    }
  } catch (const Interrupted&) {
    return false;  // the node shuts down
  }
  return false;
}

}  // namespace walker
