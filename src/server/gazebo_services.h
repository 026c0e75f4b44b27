// The services that clients written for Gazebo call.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <ros/node_handle.h>
#include <ros/service_server.h>

#include "server/parameter_reader.h"

namespace walker {

class Server;

/// Advertises private services of type std_srvs/Empty under Gazebo's names, for a remap alone does
/// not serve a client that expects another type: `pause_physics`, `unpause_physics`,
/// `reset_simulation` and `reset_world`. Both resets begin an episode, and time goes on.
class GazeboServices {
 public:
  GazeboServices(Server& server, Mode mode);

 private:
  void advertise(const std::string& name, const std::function<void()>& call);

  ros::NodeHandle node_{"~"};
  std::vector<ros::ServiceServer> advertised_;
};

}  // namespace walker
