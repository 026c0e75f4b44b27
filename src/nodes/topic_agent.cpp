// An agent that drives by topics, as a node.
#include "agents/agents.h"
#include "ros/node_main.h"

int main(int argc, char** argv) {
  return walker::run_node(argc, argv, "topic_agent",
                          [] { walker::drive_by_topics(walker::read_agent_options()); });
}
