#include "server/drive/follow.h"

#include <algorithm>
#include <stdexcept>

#include <ros/console.h>
#include <ros/names.h>
#include <ros/topic_manager.h>

#include "ros/throttle.h"

namespace walker {

FollowDrive::FollowDrive(const ServerOptions& options, Simulation& simulation)
    : RunningDrive(options, simulation),
      follower_(static_cast<std::uint64_t>(simulation.clock().dt().toNSec())) {}

void FollowDrive::restart_schedule() {
  RunningDrive::restart_schedule();
  follower_.restart();
}

void FollowDrive::step_if_due(Clock::time_point now) {
  SimulationClock& clock = simulation_.clock();
  const std::uint64_t time = std::min(ros::Time::now().toNSec(), ros::TIME_MAX.toNSec());
  const std::string clock_topic = ros::names::resolve("/clock");
  follower_.count(ros::TopicManager::instance()->getNumPublishers(clock_topic), now);
  const ClockFollower::Advice advice = follower_.look(time, clock.now().toNSec());
  clock.catch_up(ros::Time().fromNSec(advice.stamp));
  simulation_.counters().missed_deadlines += advice.missed;
  const std::string complaint = follower_.complaint();
  static Throttle throttle;
  if (!complaint.empty() && throttle.passes()) ROS_WARN_STREAM("Nothing moves: " << complaint);
  if (advice.is_due) step();
}

void FollowDrive::set_real_time_factor(double /*factor*/) {
  throw std::logic_error(
      "set_real_time_factor: this server follows /clock, so its publisher sets the pace");
}

}  // namespace walker
