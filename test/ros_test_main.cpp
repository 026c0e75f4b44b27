// The main of the rostests in C++: a node that answers while its test waits. --file=NAME runs the
// tests that stand in the source file NAME.
#include <gtest/gtest.h>
#include <ros/ros.h>

#include "test_file.h"

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "ros_test");  // rostest gives each its name
  if (!walker::test::choose_file(argc, argv)) return 2;
  ros::AsyncSpinner spinner(1);
  spinner.start();
  return RUN_ALL_TESTS();
}
