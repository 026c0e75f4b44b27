#include <cmath>

#include "base/range_finder.h"
#include "robots/robot.h"

namespace walker {
namespace {

void add(const std::vector<double>& noise, std::vector<double>& values) {
  for (std::size_t i = 0; i < noise.size(); ++i) values[i] += noise[i];
}

/// Turns by an angle about the world's y [rad].
Quaternion pitched(const Quaternion& q, double angle) {
  const double sine = std::sin(angle / 2);
  const double cosine = std::cos(angle / 2);
  return {cosine * q[0] + sine * q[2], cosine * q[1] + sine * q[3], cosine * q[2] - sine * q[0],
          cosine * q[3] - sine * q[1]};
}

}  // namespace

void add(const SensorNoise& noise, Sensors& sensors) {
  add(noise.joint_position, sensors.joint_position);
  add(noise.joint_velocity, sensors.joint_velocity);
  Quaternion& orientation = sensors.link_poses[0].orientation;
  orientation = pitched(orientation, noise.pitch);
  sensors.angular_velocity[1] += noise.angular_velocity;
  sensors.linear_velocity[0] += noise.linear_velocity[0];
  sensors.linear_velocity[2] += noise.linear_velocity[1];
  add_range_noise(noise.ranges, sensors.maximum_range, sensors.ranges.data());
}

}  // namespace walker
