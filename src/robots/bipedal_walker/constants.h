// Gymnasium's constants of BipedalWalker-v3 (gymnasium/envs/box2d/bipedal_walker.py, 1.4.0).
//
// Lengths are pixels over kScale. The arithmetic is written as Gymnasium evaluates it, because
// the bits of engine and ground, which depend on these doubles, must match.
#pragma once

#include "robots/level.h"

namespace walker::bipedal_walker {

constexpr double kStepsPerSecond = 50;
constexpr double kScale = 30.0;          // pixels per metre
constexpr double kViewportWidth = 600;   // pixels
constexpr double kViewportHeight = 400;  // pixels

constexpr float kGravity = -10;  // pybox2d's default gravity [m/s^2]

constexpr double kMotorTorque = 80;  // limit at |action| = 1 [N m]
constexpr double kHipSpeed = 4;      // speed of the velocity motor [rad/s]
constexpr double kKneeSpeed = 6;     // speed of the velocity motor [rad/s]
constexpr double kInitialPush = 5;   // largest horizontal force on the hull at reset [N]

constexpr int kVelocityIterations = 6 * 30;
constexpr int kPositionIterations = 2 * 30;

constexpr int kLidarRays = 10;
constexpr double kLidarIncrement = 0.15;      // angle between rays [rad]
constexpr double kLidarRange = 160 / kScale;  // [m]

constexpr double kLegDown = -8 / kScale;    // height of the hip relative to the hull's origin [m]
constexpr double kLegWidth = 8 / kScale;    // [m]
constexpr double kLegHeight = 34 / kScale;  // [m]
constexpr double kLowerLegTaper = 0.8;      // width of a lower leg over that of an upper leg

constexpr int kTerrainLength = 200;                              // steps
constexpr double kTerrainHeight = kViewportHeight / kScale / 4;  // height of the start pad [m]
constexpr double kTerrainFriction = 2.5;
constexpr double kFlagHeight = 50 / kScale;  // height of the flag's pole [m]

constexpr double kStartX = kTerrainStep * kTerrainStartPad / 2;  // hull's initial x [m]
constexpr double kStartY = kTerrainHeight + 2 * kLegHeight;      // hull's initial y [m]

constexpr double kFallReward = -100;      // reward of a step on which the walker falls
constexpr double kRewardThreshold = 300;  // Gymnasium's registration, both variants

/// Default of the impulse of pushes: changes the speed of the whole walker, which has 6.5 kg, by
/// 0.5 m/s [N s].
constexpr double kPushImpulse = 3;

}  // namespace walker::bipedal_walker
