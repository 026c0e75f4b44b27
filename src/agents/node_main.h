// What the mains of the agent nodes share.
#pragma once

#include <exception>

#include <ros/console.h>
#include <ros/init.h>

#include "agents/options.h"
#include "ros/signals.h"

namespace walker {

/// Runs an agent as a node. @return the process's exit status
template <typename DrivingAgent>
int run_agent_node(int argc, char** argv, const char* name) {
  ros::init(argc, argv, name, ros::init_options::NoSigintHandler);
  const EndOnSignals end_on_signals;
  try {
    ros::start();
    DrivingAgent agent(read_agent_options());
    agent.run();
  } catch (const std::exception& error) {
    ROS_FATAL_STREAM(error.what());
    return 1;
  }
  return 0;
}

}  // namespace walker
