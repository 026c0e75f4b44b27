// Node of an agent that drives by topics.
#include "agents/agents.h"
#include "ros/node_main.h"

int main(int argc, char** argv) {
  const walker::NodeDescription node{"topic_agent",
                                     "topic_agent",
                                     "Drives a walker by topics, as on a robot.",
                                     walker::agent_parameters(),
                                     {}};
  return walker::run_node(argc, argv, node,
                          [] { walker::drive_by_topics(walker::read_agent_options()); });
}
