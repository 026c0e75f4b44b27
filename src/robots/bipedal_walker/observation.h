// Lidar, layout and scaling of observations, and their computation from a robot's sensors.
#pragma once

#include <array>
#include <cstddef>
#include <memory>

#include "robots/bipedal_walker/constants.h"
#include "robots/bipedal_walker/physics.h"
#include "robots/bipedal_walker/specification.h"
#include "robots/robot.h"
#include "walker_sim/observation_builder.h"

namespace walker::bipedal_walker {

struct RayHit {
  float fraction = 1;  ///< distance to the ground over the lidar's range; 1 if nothing is hit
  bool hit = false;
};

using LidarScan = std::array<RayHit, kLidarRays>;

/// Casts ray i from the hull's origin towards (sin 0.15 i, -cos 0.15 i): ray 0 straight down, later
/// ones further forward. The rays do not turn with the hull, and hit only terrain, not the legs.
/// @param terrain the terrain that `physics` was built with
/// @param range length of the rays [m]
/// @throws std::logic_error, Box2D's assertion, if the hull's position is not finite
void cast_lidar(const Physics& physics, const Terrain& terrain, double range, LidarScan& scan);

enum ObservationIndex : std::size_t {
  kHullAngle,
  kHullAngularVelocity,
  kHorizontalSpeed,
  kVerticalSpeed,
  kFirstLeg,                   // hip angle, hip speed, knee angle, knee speed, contact
  kSecondLeg = kFirstLeg + 5,  // the same
  kFirstRay = kSecondLeg + 5,
  kObservationSize = kFirstRay + kLidarRays
};

/// Observed quantities before scaling, in Box2D's plane, whose positive angles turn about -y.
struct Observed {
  double hull_angle;                               ///< includes whole turns [rad]
  double hull_angular_velocity;                    ///< [rad/s]
  std::array<double, 2> hull_velocity;             ///< centre of mass: forward, up [m/s]
  std::array<double, kJointCount> joint_position;  ///< [rad]
  std::array<double, kJointCount> joint_velocity;  ///< [rad/s]
  std::array<bool, 2> leg_touches;
  std::array<double, kLidarRays> ray_fraction;  ///< distance over range; 1 if nothing is hit
};

/// Returns the quantities of a world, except for the rays.
Observed observed_in(const Physics& physics);

/// Adds the errors of sensors. The result is what an ObservationBuilder observes by these sensors.
/// @param center the hull's centre of mass in its frame [m]
/// @param scan the rays
/// @param range length of the rays [m]
void add(const SensorNoise& noise, const b2Vec2& center, const LidarScan& scan, double range,
         Observed& observed);

/// @param observation receives kObservationSize float32 values, as Gymnasium stores them
void write_observation(const Observed& observed, double* observation);

std::unique_ptr<ObservationBuilder> make_observation_builder(const std::string& id,
                                                             const Parameters& parameters);

}  // namespace walker::bipedal_walker
