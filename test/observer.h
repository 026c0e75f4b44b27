// An environment whose observations are also built from its sensors.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "error_message.h"
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

/// A test that changes the measurements of one instant.
class ChangedMeasurements : public testing::Test {
 protected:
  explicit ChangedMeasurements(const std::string& id, const Parameters& parameters = {})
      : observer_(id, parameters) {}

  using Change = std::function<void(Measurements&)>;

  /// Returns the error message. The observation must stay untouched.
  std::string refusal(const Change& change) const {
    Measurements other = measurements_;
    change(other);
    const std::vector<double> before(observer_.built.size(), -7);
    std::vector<double> observation = before;
    std::string message = message_of<std::invalid_argument>(
        [&] { observer_.builder->build(other, observation.data()); });
    EXPECT_EQ(observation, before) << "untouched";
    return message;
  }

  Observer observer_;
  Measurements measurements_;
};

}  // namespace walker
