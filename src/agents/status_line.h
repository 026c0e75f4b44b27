// One line a second on the terminal: how the walker fares.
#pragma once

#include <string>

#include <nav_msgs/Odometry.h>
#include <ros/node_handle.h>
#include <ros/subscriber.h>
#include <ros/wall_timer.h>

#include "walker_sim/EnvironmentSpec.h"
#include "walker_sim/Episode.h"
#include "walker_sim/Transition.h"

namespace walker {

/// Listens to spec, transition, odom and episode and prints by wall time.
class StatusLine {
 public:
  StatusLine();

 private:
  void on_episode(const walker_sim::Episode& episode);
  void print();

  ros::NodeHandle node_;
  ros::Subscriber spec_subscriber_;
  ros::Subscriber transition_subscriber_;
  ros::Subscriber odometry_subscriber_;
  ros::Subscriber episode_subscriber_;
  ros::WallTimer timer_;
  std::string id_;
  walker_sim::Transition transition_;
  nav_msgs::Odometry odometry_;
  ros::WallTime printed_at_;
  ros::Time printed_stamp_;
};

}  // namespace walker
