// How an observation is laid out and scaled.
#pragma once

#include <array>
#include <cstddef>

#include "robots/bipedal_walker/constants.h"
#include "robots/bipedal_walker/physics.h"

namespace walker::bipedal_walker {

/// Places in the observation.
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

/// What is observed, before any scale; in Box2D's plane, whose angles turn about -y.
struct Observed {
  double hull_angle;                               ///< counts whole turns [rad]
  double hull_angular_velocity;                    ///< [rad/s]
  std::array<double, 2> hull_velocity;             ///< of its centre of mass: forward, up [m/s]
  std::array<double, kJointCount> joint_position;  ///< [rad]
  std::array<double, kJointCount> joint_velocity;  ///< [rad/s]
  std::array<bool, 2> leg_touches;
  std::array<double, kLidarRays> ray_fraction;  ///< of kLidarRange; 1: the ray met nothing
};

/// @param observation kObservationSize float32 values, as Gymnasium stores them
void write_observation(const Observed& observed, double* observation);

}  // namespace walker::bipedal_walker
