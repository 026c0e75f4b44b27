// An agent that drives by topics, as a node.
#include "agents/topic_agent.h"

#include "agents/node_main.h"

int main(int argc, char** argv) {
  return walker::run_agent_node<walker::TopicAgent>(argc, argv, "topic_agent");
}
