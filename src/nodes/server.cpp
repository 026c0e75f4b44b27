// Node of the environment server.
#include "server/server.h"
#include "ros/node_main.h"

int main(int argc, char** argv) {
  const walker::NodeDescription node{
      "server", "walker_sim", "Steps walkers: services, topics and the simulation's clock.",
      walker::server_parameters(), walker::environment_parameter_names()};
  return walker::run_node(argc, argv, node,
                          [] { walker::Server(walker::read_server_options()).run(); });
}
