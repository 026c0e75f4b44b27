#include "robots/bipedal_walker/observation.h"

#include <algorithm>

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

}  // namespace walker::bipedal_walker
