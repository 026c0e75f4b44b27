// Node that prints one status line per second of wall time.
#include <array>
#include <cstdio>
#include <string>

#include <nav_msgs/Odometry.h>
#include <ros/init.h>
#include <ros/node_handle.h>
#include <ros/subscriber.h>
#include <ros/wall_timer.h>

#include "base/printable_text.h"
#include "ros/checked_message.h"
#include "ros/node_main.h"
#include "ros/private_parameters.h"
#include "walker_sim/EnvironmentSpec.h"
#include "walker_sim/Episode.h"

namespace {

using walker::subscribe_checked;

/// Does not subscribe to `transition`: each message takes time from the server and its clients.
class StatusLine {
 public:
  StatusLine()
      : subscribers_{subscribe_checked<walker_sim::EnvironmentSpec>(
                         node_, "spec", 1, [this](const auto& message) { id_ = message->id; }),
                     subscribe_checked<walker_sim::Episode>(
                         node_, "progress", 100, [this](const auto& message) { take(*message); }),
                     subscribe_checked<nav_msgs::Odometry>(
                         node_, "odom", 1, [this](const auto& message) { odometry_ = *message; })},
        timer_(node_.createWallTimer(ros::WallDuration(1),
                                     [this](const ros::WallTimerEvent&) { print(); })) {}

 private:
  void take(const walker_sim::Episode& progress) {
    walker::set_time(progress.header.stamp);
    progress_ = progress;
    if (progress.end_reason.empty()) return;
    const ros::WallTime now = ros::WallTime::now();
    if (now - end_printed_at_ < ros::WallDuration(1)) return;  // episodes may be a few steps long
    end_printed_at_ = now;
    std::printf("episode %u ended after %u steps, return %+.1f, %s\n", progress.episode,
                progress.length, progress.episode_return,
                walker::printable(progress.end_reason).c_str());
    std::fflush(stdout);
  }

  void print() {
    if (progress_.episode == 0) return;
    const ros::WallTime now = ros::WallTime::now();
    const ros::Time stamp = progress_.header.stamp;
    const double factor =
        printed_stamp_.isZero() || now <= printed_at_
            ? 0
            : (stamp.toSec() - printed_stamp_.toSec()) / (now - printed_at_).toSec();
    std::printf(
        "%s  time %8.2f s  x%-5.2f episode %u  step %4u  at %6.2f m  %+5.2f m/s  return %+7.1f\n",
        walker::printable(id_).c_str(), stamp.toSec(), factor, progress_.episode, progress_.length,
        odometry_.pose.pose.position.x, odometry_.twist.twist.linear.x, progress_.episode_return);
    std::fflush(stdout);
    printed_at_ = now;
    printed_stamp_ = stamp;
  }

  ros::NodeHandle node_;
  std::string id_;
  walker_sim::Episode progress_;
  nav_msgs::Odometry odometry_;
  ros::WallTime end_printed_at_;
  ros::WallTime printed_at_;
  ros::Time printed_stamp_;
  std::array<ros::Subscriber, 3> subscribers_;
  ros::WallTimer timer_;
};

void print_status() {
  walker::complete_parameters({}, walker::private_parameters());  // refuses any
  const StatusLine line;
  ros::spin();
}

}  // namespace

int main(int argc, char** argv) {
  const walker::NodeDescription node{"status_line", "status_line",
                                     "Prints one status line per second."};
  return walker::run_node(argc, argv, node, print_status);
}
