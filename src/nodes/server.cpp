// The environment server as a node.
#include "server/server.h"
#include "ros/node_main.h"

int main(int argc, char** argv) {
  return walker::run_node(argc, argv, "walker_sim",
                          [] { walker::Server(walker::read_server_options()).run(); });
}
