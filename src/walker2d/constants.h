// Gymnasium's constants of Walker2d (gymnasium/envs/mujoco/walker2d_v4.py, walker2d_v5.py, 1.4.0).
#pragma once

namespace walker::walker2d {

/// The layout that every model must have: the trunk's x, z and pitch, then six driven hinges.
constexpr int kRootJoints = 3;
constexpr int kJointCount = 6;
constexpr int kDegreesOfFreedom = kRootJoints + kJointCount;

/// Places in MuJoCo's qpos and qvel.
enum RootIndex { kRootX, kRootZ, kRootPitch };

constexpr int kFrameSkip = 4;         // engine steps a step
constexpr double kMostVelocity = 10;  // observed velocities are clipped there [m/s, rad/s]

}  // namespace walker::walker2d
