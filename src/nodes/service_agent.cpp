// Node of an agent that drives by ~step.
#include "agents/agents.h"
#include "ros/node_main.h"

int main(int argc, char** argv) {
  const walker::NodeDescription node{"service_agent",
                                     "service_agent",
                                     "Drives a walker by the service ~step.",
                                     walker::agent_parameters(),
                                     {}};
  return walker::run_node(argc, argv, node,
                          [] { walker::drive_by_services(walker::read_agent_options()); });
}
