// Messages that would come with every step, once a second.
#pragma once

#include <ros/time.h>

namespace walker {

/// Lets pass one message a second. By wall time: simulation time may stand still, or fly.
class Throttle {
 public:
  bool passes() {
    const ros::WallTime now = ros::WallTime::now();
    if (now - last_ < ros::WallDuration(1)) return false;
    last_ = now;
    return true;
  }

 private:
  ros::WallTime last_;
};

}  // namespace walker
