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
/// ones further forward. The rays do not turn with the hull, and hit only ground, not the legs.
///
/// With the origin o and the end e_i = o + range (sin 0.15 i, -cos 0.15 i), a fraction is the
/// smallest t in [0, 1] at which o + t (e_i - o) is on the ground. For an edge from p to q with
/// the normal n:
///
///   t = n . (p - o) / n . (e_i - o),   a hit if 0 <= (o + t (e_i - o) - p) . (q - p) <= |q - p|^2
///
/// Source: Gymnasium 1.4.0, envs/box2d/bipedal_walker.py, BipedalWalker.step and LidarCallback;
/// Box2D (box2d-py 2.3.8), Collision/Shapes/b2EdgeShape.cpp and b2PolygonShape.cpp, RayCast.
/// @param ground the ground that `physics` was built with
/// @param range length of the rays [m]
/// @throws std::logic_error, Box2D's assertion, if the hull's position is not finite
void cast_lidar(const Physics& physics, const Ground& ground, double range, LidarScan& scan);

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
///
/// Joints, the hull's angle a and its angular velocity w receive their errors (negated for a and w,
/// because Box2D's angles turn about -y). Sensors measure the velocity of the hull's origin, so the
/// errors of a and w also change v, the velocity of the centre of mass c. With the rotation R, the
/// velocity's error e_v and a ray's error e_r:
///
///   v       += e_v + R(a) (w x c) after the errors - R(a) (w x c) before
///   fraction = clamp(range * fraction + e_r, 0, range) / range    if the ray hits
///
/// @param center the hull's centre of mass in its frame [m]
/// @param scan the rays
/// @param range length of the rays [m]
void add(const SensorNoise& noise, const b2Vec2& center, const LidarScan& scan, double range,
         Observed& observed);

/// Scales the observed quantities:
///
///   [0]      hull angle [rad]
///   [1]      2 w / 50                        w: hull's angular velocity [rad/s]
///   [2]      0.3 vx (600 / 30) / 50          v: velocity of the hull's centre of mass [m/s]
///   [3]      0.3 vy (400 / 30) / 50
///   [4..8]   leg 1: hip angle, hip speed / 4, knee angle + 1, knee speed / 6, contact (0 or 1)
///   [9..13]  leg 2: the same
///   [14..23] fractions of the rays
///
/// Source: Gymnasium 1.4.0, envs/box2d/bipedal_walker.py, BipedalWalker.step.
/// @param observation receives kObservationSize float32 values, as Gymnasium stores them
void write_observation(const Observed& observed, double* observation);

std::unique_ptr<ObservationBuilder> make_observation_builder(const std::string& id,
                                                             const Parameters& parameters);

}  // namespace walker::bipedal_walker
