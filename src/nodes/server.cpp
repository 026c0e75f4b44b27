// Node of the environment server.
#include <ros/param.h>

#include "ros/node_main.h"
#include "server/server.h"

namespace {

bool follows_clock() { return !ros::param::param("~publish_clock", true); }

}  // namespace

int main(int argc, char** argv) {
  const walker::NodeDescription node{"server",
                                     "walker_sim",
                                     "Steps walkers: services, topics and the simulation's clock.",
                                     walker::server_parameters(),
                                     walker::environment_parameter_names(),
                                     &follows_clock};
  return walker::run_node(argc, argv, node,
                          [] { walker::Server(walker::read_server_options()).run(); });
}
