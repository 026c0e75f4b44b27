#include "robots/bipedal_walker/observation.h"

#include <algorithm>
#include <cmath>

#include "base/checks.h"
#include "base/unwrapped_angle.h"

namespace walker::bipedal_walker {
namespace {

/// Rounds to float32, as Gymnasium stores the state.
double rounded(double value) { return static_cast<double>(static_cast<float>(value)); }

}  // namespace

Observed observed_in(const Physics& physics) {
  const b2Body& hull = physics.hull();
  const b2Vec2 velocity = hull.GetLinearVelocity();  // centre of mass
  Observed observed{};
  observed.hull_angle = double{hull.GetAngle()};
  observed.hull_angular_velocity = double{hull.GetAngularVelocity()};
  observed.hull_velocity = {double{velocity.x}, double{velocity.y}};
  for (std::size_t i = 0; i < kJointCount; ++i) {
    observed.joint_position[i] = double{physics.joint(i).GetJointAngle()};
    observed.joint_velocity[i] = double{physics.joint(i).GetJointSpeed()};
  }
  for (std::size_t leg = 0; leg < 2; ++leg) observed.leg_touches[leg] = physics.leg_touches(leg);
  return observed;
}

void write_observation(const Observed& observed, double* observation) {
  const auto [forward, up] = observed.hull_velocity;
  observation[kHullAngle] = rounded(observed.hull_angle);
  observation[kHullAngularVelocity] =
      rounded(2.0 * observed.hull_angular_velocity / kStepsPerSecond);
  observation[kHorizontalSpeed] =
      rounded(0.3 * forward * (kViewportWidth / kScale) / kStepsPerSecond);
  observation[kVerticalSpeed] = rounded(0.3 * up * (kViewportHeight / kScale) / kStepsPerSecond);
  for (std::size_t leg = 0; leg < 2; ++leg) {
    const std::size_t hip = 2 * leg;
    const std::size_t knee = hip + 1;
    double* part = observation + (leg == 0 ? kFirstLeg : kSecondLeg);
    part[0] = rounded(observed.joint_position[hip]);
    part[1] = rounded(observed.joint_velocity[hip] / kHipSpeed);
    part[2] = rounded(observed.joint_position[knee] + 1.0);
    part[3] = rounded(observed.joint_velocity[knee] / kKneeSpeed);
    part[4] = observed.leg_touches[leg] ? 1.0 : 0.0;
  }
  std::transform(observed.ray_fraction.begin(), observed.ray_fraction.end(),
                 observation + kFirstRay, rounded);
}

namespace {

class Builder : public ObservationBuilder {
 public:
  explicit Builder(std::shared_ptr<const Specification> specification)
      : specification_(std::move(specification)) {}

  void reset() override { hull_angle_.reset(); }

  void build(const Measurements& measurements, double* observation) override {
    check_measurements(measurements, *specification_);
    Observed observed{};
    // Rotation about -y. Roll and yaw, which a real robot also has, are outside Box2D's plane.
    const Quaternion& q = measurements.orientation;
    observed.hull_angle = hull_angle_.follow(2 * std::atan2(-q[1], q[3]));
    observed.hull_angular_velocity = -measurements.angular_velocity[1];
    observed.hull_velocity = velocity_of_center(measurements, observed);
    std::copy_n(measurements.joint_position.begin(), kJointCount, observed.joint_position.begin());
    std::copy_n(measurements.joint_velocity.begin(), kJointCount, observed.joint_velocity.begin());
    std::transform(measurements.contacts.begin(), measurements.contacts.end(),
                   observed.leg_touches.begin(), [](std::uint8_t touches) { return touches != 0; });
    std::transform(measurements.ranges.begin(), measurements.ranges.end(),
                   observed.ray_fraction.begin(),
                   [](double range) { return std::min(range / kLidarRange, 1.0); });
    write_observation(observed, observation);
  }

 private:
  /// Converts the hull origin's velocity in hull axes to the centre of mass's in world axes.
  std::array<double, 2> velocity_of_center(const Measurements& measurements,
                                           const Observed& observed) const {
    const Vector3& center = specification_->links.front().center_of_mass;
    const double turning = observed.hull_angular_velocity;
    const double along = measurements.linear_velocity[0] - turning * center[2];
    const double across = measurements.linear_velocity[2] + turning * center[0];
    const double sine = std::sin(observed.hull_angle);
    const double cosine = std::cos(observed.hull_angle);
    return {cosine * along - sine * across, sine * along + cosine * across};
  }

  std::shared_ptr<const Specification> specification_;
  UnwrappedAngle hull_angle_;
};

}  // namespace

std::unique_ptr<ObservationBuilder> make_observation_builder(const Options& options) {
  return std::make_unique<Builder>(make_specification(options));
}

}  // namespace walker::bipedal_walker
