// Messages that would come with every step, or with every client, once a second.
#pragma once

#include <cstdint>
#include <string>
#include <utility>

#include <ros/time.h>

namespace walker {

/// Lets pass one message a second. By wall time: simulation time may stand still, or fly.
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

  /// To be told with a message that passes, once: how many did not since the one before.
  /// @return empty where none was left out
  std::string left_out() {
    const std::uint64_t count = std::exchange(left_out_, 0);
    return count == 0 ? "" : " (and " + std::to_string(count) + " more since the last such line)";
  }

 private:
  ros::WallTime last_;
  std::uint64_t left_out_ = 0;
};

}  // namespace walker
