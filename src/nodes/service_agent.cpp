// An agent that drives by ~step, as a node.
#include "agents/agents.h"
#include "ros/node_main.h"

int main(int argc, char** argv) {
  return walker::run_node(argc, argv, "service_agent",
                          [] { walker::drive_by_services(walker::read_agent_options()); });
}
