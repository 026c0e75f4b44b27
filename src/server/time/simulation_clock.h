// Simulation time: integer nanoseconds that never decrease.
#pragma once

#include <memory>
#include <string>

#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <ros/time.h>

#include "server/time/time_reservation.h"

namespace walker {

/// The time of a server's stamps. If the server owns /clock, also publishes it, and sets this
/// node's ROS time: roscpp's own subscription to /clock would wake two threads per message.
///
/// Time continues where the last owner of /clock on this master stopped, even if that was killed:
/// an owner reserves time ahead on the parameter server. If the master does not answer, nothing
/// blocks; see time_reservation.h.
class SimulationClock {
 public:
  /// Does not publish.
  /// @param dt simulation time of a step [s]
  /// @throws std::invalid_argument if dt >= 2^31 s, where durations in ROS end
  explicit SimulationClock(double dt);
  /// Owns and publishes /clock.
  /// @throws std::exception naming another publisher of /clock, or an invalid `kReservedUntil`
  SimulationClock(ros::NodeHandle& node, double dt);

  // Not movable: a callback of the publisher points to it.
  SimulationClock(const SimulationClock&) = delete;
  SimulationClock& operator=(const SimulationClock&) = delete;
  ~SimulationClock() = default;

  ros::Time now() const { return now_; }
  /// Rounded to nanoseconds.
  ros::Duration dt() const { return dt_; }

  /// Checks that ROS time, which ends at 2^32 s, has room for this many steps.
  /// @throws std::range_error if it has not
  void require(int steps = 1) const;

  /// Advances by a step, without publishing.
  /// @throws std::range_error at the end of ROS time; then nothing has changed
  void advance();

  /// If this is the owner, publishes the present time unless that has been published.
  void publish();

  /// Why a server started after this one may begin below its time; empty if it cannot.
  std::string complaint() const { return reservation_ ? reservation_->complaint() : ""; }

  /// Advances to `time` if that lies ahead, without publishing.
  void catch_up(ros::Time time);

 private:
  void publish_again();

  ros::Duration dt_;
  ros::Time now_;
  bool is_published_ = false;                     // the present time
  ros::Publisher publisher_;                      // empty unless owner
  std::unique_ptr<TimeReservation> reservation_;  // null unless owner
};

}  // namespace walker
