#include "agents/remote_specification.h"

#include <ros/console.h>
#include <ros/init.h>
#include <ros/service.h>

#include "walker_sim/GetSpec.h"
#include "walker_sim/registry.h"

namespace walker {

std::optional<Specification> ask_specification(ros::NodeHandle& node, const std::string& server) {
  const std::string name = server + "/get_spec";
  walker_sim::GetSpec call;
  for (bool said = false; ros::ok(); said = true) {
    // A wall-clock wait: simulation time stands still until the server's first step.
    if (ros::service::waitForService(name, ros::Duration(1)) &&
        node.serviceClient<walker_sim::GetSpec>(name).call(call)) {
      return make(call.response.spec.id)->specification();
    }
    if (!said && ros::ok()) ROS_INFO_STREAM("Waiting for " << node.resolveName(name));
  }
  return std::nullopt;
}

}  // namespace walker
