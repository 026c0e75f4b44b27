#include "agents/status_line.h"

#include <cstdio>

#include "ros/checked_subscription.h"

namespace walker {
namespace {

constexpr double kWallPeriod = 1;  // [s]

}  // namespace

StatusLine::StatusLine()
    : spec_subscriber_(subscribe_checked<walker_sim::EnvironmentSpec>(
          node_, "spec", 1, [this](const auto& message) { id_ = message->id; })),
      transition_subscriber_(subscribe_checked<walker_sim::Transition>(
          node_, "transition", 1, [this](const auto& message) { transition_ = *message; })),
      odometry_subscriber_(subscribe_checked<nav_msgs::Odometry>(
          node_, "odom", 1, [this](const auto& message) { odometry_ = *message; })),
      episode_subscriber_(subscribe_checked<walker_sim::Episode>(
          node_, "episode", 10, [this](const auto& message) { on_episode(*message); })),
      timer_(node_.createWallTimer(ros::WallDuration(kWallPeriod),
                                   [this](const ros::WallTimerEvent&) { print(); })) {}

void StatusLine::on_episode(const walker_sim::Episode& episode) {
  if (episode.end_reason.empty()) return;  // begins
  std::printf("episode %u ended after %u steps, return %+.1f, %s\n", episode.episode,
              episode.length, episode.episode_return, episode.end_reason.c_str());
  std::fflush(stdout);
}

void StatusLine::print() {
  if (transition_.episode == 0) return;
  const ros::WallTime now = ros::WallTime::now();
  const ros::Time stamp = transition_.header.stamp;
  const double factor =
      printed_stamp_.isZero() || now <= printed_at_
          ? 0
          : (stamp.toSec() - printed_stamp_.toSec()) / (now - printed_at_).toSec();
  std::printf(
      "%s  time %8.2f s  x%-5.2f episode %u  step %4u  at %6.2f m  %+5.2f m/s  return %+7.1f\n",
      id_.c_str(), stamp.toSec(), factor, transition_.episode, transition_.step,
      odometry_.pose.pose.position.x, odometry_.twist.twist.linear.x, transition_.episode_return);
  std::fflush(stdout);
  printed_at_ = now;
  printed_stamp_ = stamp;
}

}  // namespace walker
