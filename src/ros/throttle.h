// Rate limit of log messages that could come with every step or from every client.
#pragma once

#include <cstdint>
#include <string>
#include <utility>

#include <ros/time.h>

namespace walker {

/// Passes one message per second of wall time: simulation time may stand still, or run fast.
class Throttle {
 public:
  bool passes() {
    const ros::WallTime now = ros::WallTime::now();
    if (now - last_ < ros::WallDuration(1)) {
      ++left_out_;
      return false;
    }
    last_ = now;
    return true;
  }

  /// Returns a suffix for a message that passes, with the number of messages suppressed since the
  /// last call; empty if none were. Resets the number.
  std::string left_out() {
    const std::uint64_t count = std::exchange(left_out_, 0);
    return count == 0 ? "" : " (and " + std::to_string(count) + " more since the last such line)";
  }

 private:
  ros::WallTime last_;
  std::uint64_t left_out_ = 0;
};

}  // namespace walker
