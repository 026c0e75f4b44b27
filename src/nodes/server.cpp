// The environment server as a node.
#include <exception>

#include <ros/console.h>
#include <ros/init.h>

#include "ros/signals.h"
#include "server/server.h"

int main(int argc, char** argv) {
  ros::init(argc, argv, "walker_sim", ros::init_options::NoSigintHandler);
  const walker::EndOnSignals end_on_signals;
  try {
    ros::start();
    walker::Server server(walker::read_server_options());
    server.run();
  } catch (const std::exception& error) {
    ROS_FATAL_STREAM(error.what());
    return 1;
  }
  return 0;
}
