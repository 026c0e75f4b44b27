// One line a second on the terminal, as a node.
#include <ros/init.h>

#include "agents/status_line.h"

int main(int argc, char** argv) {
  ros::init(argc, argv, "status_line");
  const walker::StatusLine line;
  ros::spin();
  return 0;
}
