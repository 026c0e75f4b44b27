// Converts sensors to what a subscriber of the server's topics measures, without ROS.
#pragma once

#include <algorithm>

#include "pose_algebra.h"
#include "walker_sim/observation_builder.h"
#include "walker_sim/sensors.h"

namespace walker {

/// Velocities are in the trunk's frame, as in imu and odom. Ranges are rounded to single precision,
/// as in scan.
inline Measurements measurements_of(const Sensors& sensors) {
  const Pose& trunk = sensors.link_poses.front();
  const auto& [x, y, z, w] = trunk.orientation;
  const Quaternion to_trunk{-x, -y, -z, w};
  Measurements measurements;
  measurements.joint_position = sensors.joint_position;
  measurements.joint_velocity = sensors.joint_velocity;
  measurements.orientation = trunk.orientation;
  measurements.angular_velocity = rotated(to_trunk, sensors.angular_velocity);
  measurements.position = trunk.position;
  measurements.linear_velocity = rotated(to_trunk, sensors.linear_velocity);
  measurements.contacts = sensors.contacts;
  measurements.ranges.resize(sensors.ranges.size());
  std::transform(sensors.ranges.begin(), sensors.ranges.end(), measurements.ranges.begin(),
                 [](double range) { return double{static_cast<float>(range)}; });
  return measurements;
}

}  // namespace walker
