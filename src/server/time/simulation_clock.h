// Simulation time: integer nanoseconds that only ever grow.
#pragma once

#include <memory>
#include <string>

#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <ros/time.h>

#include "server/time/time_reservation.h"

namespace walker {

/// The time that a server stamps with, and /clock where the server owns it.
///
/// Time goes on where the last owner of /clock on this master stopped, even one that was killed: an
/// owner reserves a stretch of time ahead on the parameter server, and the next one begins above
/// all that was reserved. A master that does not answer holds nobody up: time_reservation.h says
/// what is promised then.
class SimulationClock {
 public:
  /// Stamps only.
  /// @param dt of a step [s]
  /// @throws std::invalid_argument for a step from 2^31 s on, where durations in ROS end
  explicit SimulationClock(double dt);
  /// Owner of /clock.
  /// @throws std::runtime_error naming the node that publishes /clock already; as the other
  SimulationClock(ros::NodeHandle& node, double dt);

  // Stays where it was made: a callback of the publisher points to it.
  SimulationClock(const SimulationClock&) = delete;
  SimulationClock& operator=(const SimulationClock&) = delete;
  ~SimulationClock() = default;

  ros::Time now() const { return now_; }
  /// In whole nanoseconds.
  ros::Duration dt() const { return dt_; }

  /// Whether there is a time so many steps from now. ROS time ends at 2^32 s.
  /// @throws std::range_error when there is none
  void require(int steps = 1) const;

  /// Moves on by a step and publishes the new time where this is the owner.
  /// @throws std::range_error at the end of ROS time; then nothing has changed
  void advance();

  /// Why a server that is started after this one may begin below its time; empty: it will not.
  std::string complaint() const { return reservation_ ? reservation_->complaint() : ""; }

  /// Moves on to `time` if that lies ahead, without publishing.
  void catch_up(ros::Time time);

 private:
  void publish();

  ros::Duration dt_;
  ros::Time now_;
  ros::Publisher publisher_;                      // empty unless owner
  std::unique_ptr<TimeReservation> reservation_;  // as is this
};

}  // namespace walker
