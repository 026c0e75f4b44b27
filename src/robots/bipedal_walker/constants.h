// Gymnasium's constants of BipedalWalker-v3 (gymnasium/envs/box2d/bipedal_walker.py, 1.4.0).
//
// Lengths are pixels over kScale. The arithmetic is written as Gymnasium evaluates it, for these
// doubles reach the engine and the terrain, whose bits are compared.
#pragma once

namespace walker::bipedal_walker {

constexpr double kStepsPerSecond = 50;
constexpr double kScale = 30.0;          // pixels per metre
constexpr double kViewportWidth = 600;   // pixels
constexpr double kViewportHeight = 400;  // pixels

constexpr float kGravity = -10;  // pybox2d's default for a world made without arguments [m/s^2]

constexpr double kMotorTorque = 80;  // limit at |action| = 1 [N m]
constexpr double kHipSpeed = 4;      // of the velocity motor [rad/s]
constexpr double kKneeSpeed = 6;     // of the velocity motor [rad/s]
constexpr double kInitialPush = 5;   // largest horizontal force on the hull at reset [N]

constexpr int kVelocityIterations = 6 * 30;
constexpr int kPositionIterations = 2 * 30;

constexpr int kLidarRays = 10;
constexpr double kLidarIncrement = 0.15;      // between rays [rad]
constexpr double kLidarRange = 160 / kScale;  // [m]

constexpr double kLegDown = -8 / kScale;    // hip below the hull's origin [m]
constexpr double kLegWidth = 8 / kScale;    // [m]
constexpr double kLegHeight = 34 / kScale;  // [m]
constexpr double kLowerLegTaper = 0.8;      // width of a lower leg over an upper one's

constexpr double kTerrainStep = 14 / kScale;                     // [m]
constexpr int kTerrainLength = 200;                              // steps
constexpr double kTerrainHeight = kViewportHeight / kScale / 4;  // of the start pad [m]
constexpr int kTerrainGrass = 10;     // longest grass between obstacles; steps
constexpr int kTerrainStartPad = 20;  // flat steps before the first bump
constexpr double kTerrainFriction = 2.5;
constexpr double kFlagHeight = 50 / kScale;  // of the pole, pixels in `render` [m]

constexpr double kStartX = kTerrainStep * kTerrainStartPad / 2;  // of the hull [m]
constexpr double kStartY = kTerrainHeight + 2 * kLegHeight;      // of the hull [m]

constexpr double kFallReward = -100;      // of the step on which it falls
constexpr double kRewardThreshold = 300;  // Gymnasium's registration, both variants

}  // namespace walker::bipedal_walker
