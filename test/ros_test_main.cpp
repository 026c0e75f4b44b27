// main() of the C++ rostests. The node's spinner thread serves callbacks while a test blocks.
// --file=NAME runs only the tests of the source file NAME.
#include <gtest/gtest.h>
#include <ros/ros.h>

#include "test_file.h"

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "ros_test");  // rostest remaps the name
  if (!walker::test::choose_file(argc, argv)) return 2;
  ros::AsyncSpinner spinner(1);
  spinner.start();
  return RUN_ALL_TESTS();
}
