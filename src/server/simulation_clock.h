// Simulation time: integer nanoseconds that only ever grow.
#pragma once

#include <chrono>

#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <ros/time.h>

namespace walker {

/// In whole nanoseconds.
/// @param seconds of a step
/// @throws std::invalid_argument from 2^31 s on, where durations in ROS end
ros::Duration to_duration(double seconds);

/// The time that a server stamps with, and /clock where the server owns it.
///
/// Time goes on where the last owner of /clock on this master stopped, even one that was killed: an
/// owner reserves a stretch of time ahead on the parameter server, and the next one begins above
/// all that was reserved.
class SimulationClock {
 public:
  /// Owner of /clock.
  /// @throws std::runtime_error naming the node that publishes /clock already
  static SimulationClock owner(ros::NodeHandle& node);
  /// Stamps only.
  static SimulationClock silent();

  // Stays where it was made: a callback of the publisher points to it.
  SimulationClock(const SimulationClock&) = delete;
  SimulationClock& operator=(const SimulationClock&) = delete;
  ~SimulationClock();

  ros::Time now() const { return now_; }

  /// Whether there is a time `dt` from now. ROS time ends at 2^32 s.
  /// @throws std::range_error when there is none
  void require(ros::Duration dt) const;

  /// Moves on by `dt` and publishes the new time where this is the owner.
  /// @throws std::range_error at the end of ROS time; then nothing has changed
  void advance(ros::Duration dt);

  /// Moves on to `time` if that lies ahead, without publishing.
  void catch_up(ros::Time time);

 private:
  SimulationClock() = default;
  explicit SimulationClock(ros::NodeHandle& node);  // owner
  void reserve();
  void publish();

  ros::Time now_;
  ros::Publisher publisher_;  // empty unless owner
  ros::Time reserved_;        // nobody but this owner uses times up to here
  ros::Time reserved_from_;
  std::chrono::steady_clock::time_point reserved_at_;
};

}  // namespace walker
