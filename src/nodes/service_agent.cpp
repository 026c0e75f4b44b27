// An agent that drives by ~step, as a node.
#include "agents/service_agent.h"

#include "agents/node_main.h"

int main(int argc, char** argv) {
  return walker::run_agent_node<walker::ServiceAgent>(argc, argv, "service_agent");
}
