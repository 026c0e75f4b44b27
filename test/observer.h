// An environment whose observations are also built from its sensors.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "pose_algebra.h"
#include "stepper.h"
#include "walker_sim/observation_builder.h"
#include "walker_sim/registry.h"
#include "walker_sim/sensors.h"

namespace walker {

/// Converts sensors to what a subscriber of the server's topics measures.
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

class Observer {
 public:
  explicit Observer(const std::string& id, const Parameters& parameters = {})
      : walker(id, parameters),
        builder(make_observation_builder(id, parameters)),
        built(walker.observation.size()) {}

  void reset(std::uint64_t seed) {
    walker.reset(seed);
    builder->reset();
    observe();
  }

  void step(const std::vector<double>& action) {
    walker.step(action);
    observe();
  }

  /// Returns the largest absolute difference between the environment's and the built observation.
  double largest_difference() const {
    double largest = 0;
    for (std::size_t i = 0; i < built.size(); ++i) {
      largest = std::max(largest, std::abs(built[i] - walker.observation[i]));
    }
    return largest;
  }

  /// Returns the indices of the built observation that change if `change` is applied.
  std::vector<std::size_t> changed_by(const Measurements& before,
                                      const std::function<void(Measurements&)>& change) const {
    Measurements after = before;
    change(after);
    std::vector<double> one(built.size());
    std::vector<double> other(built.size());
    builder->build(before, one.data());
    builder->build(after, other.data());
    std::vector<std::size_t> places;
    for (std::size_t i = 0; i < one.size(); ++i) {
      if (one[i] != other[i]) places.push_back(i);
    }
    return places;
  }

  Stepper walker;
  std::unique_ptr<ObservationBuilder> builder;
  Measurements measurements;
  std::vector<double> built;

 private:
  void observe() {
    walker.environment->sense(sensors_);
    measurements = measurements_of(sensors_);
    builder->build(measurements, built.data());
  }

  Sensors sensors_;
};

}  // namespace walker
