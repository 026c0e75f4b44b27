#include "agents/remote_specification.h"

#include <exception>
#include <stdexcept>

#include <ros/console.h>
#include <ros/init.h>
#include <ros/service.h>

#include "ros/records.h"
#include "walker_sim/GetSpec.h"
#include "walker_sim/registry.h"

namespace walker {
namespace {

/// What an environment with the server's parameters says; messages carry only a part of it.
Specification to_specification(const walker_sim::EnvironmentSpec& message) {
  if (message.num_envs > 1) {
    throw std::invalid_argument("the server has num_envs = " + std::to_string(message.num_envs) +
                                "; an agent drives 1, and several are driven by ~step_batch");
  }
  try {
    return make(message.id, parameters_of(message))->specification();
  } catch (const std::exception& error) {
    throw std::invalid_argument("the server's environment cannot be made here: " +
                                std::string(error.what()));
  }
}

}  // namespace

std::optional<Specification> ask_specification(ros::NodeHandle& node, const std::string& server) {
  const std::string name = server + "/get_spec";
  walker_sim::GetSpec call;
  for (bool said = false; ros::ok(); said = true) {
    // A wall-clock wait: simulation time stands still until the server's first step.
    if (ros::service::waitForService(name, ros::Duration(1)) &&
        node.serviceClient<walker_sim::GetSpec>(name).call(call)) {
      return to_specification(call.response.spec);
    }
    if (!said && ros::ok()) ROS_INFO_STREAM("Waiting for " << node.resolveName(name));
  }
  return std::nullopt;
}

}  // namespace walker
