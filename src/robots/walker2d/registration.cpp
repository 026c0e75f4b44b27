#include "robots/walker2d/registration.h"

#include <utility>

#include "robots/mujoco/kernel/kernel_physics.h"
#include "robots/mujoco/locomotion_robot.h"

namespace walker::walker2d {
namespace {

/// Weights of a gait that walks through whole episodes of Walker2d-v4 and v5, about 26 m in 8 s.
///
/// Found by augmented random search V2-t (H. Mania, A. Guy, B. Recht: Simple random search provides
/// a competitive approach to reinforcement learning, 2018) on Walker2d-v5: 90 updates, each from
/// the best 30 of 40 directions, step size 0.03, noise 0.025. The normalization of the observation
/// is folded into the weights, which are rounded to five digits.
std::vector<mujoco::MotorWeights> gait() {
  return {
      {0.016361,
       {-1.3453, -0.45289, -0.44019, -0.61576, 0.076414, -1.0674, 0.060101, 0.10878, -0.07482,
        -0.19268, -0.031074, -0.11211, 0.0027852, 0.009589, 0.00070069, -0.025323,
        0.0020071}},  // thigh_joint
      {0.33034,
       {-1.6624, -0.37512, 0.20325, -0.73936, 0.14591, 0.091575, -0.13193, 0.17468, 0.0446,
        -0.15961, 0.0080271, 0.0013748, -0.046108, 0.0034846, -0.011078, -0.016008,
        0.011483}},  // leg_joint
      {-2.8261,
       {2.3168, -0.17289, -0.048328, -0.22639, -0.17834, 0.51343, -0.38705, -0.12417, -0.06609,
        -0.13531, -0.043719, -0.00611, 0.0037218, 0.010768, -0.033609, -0.009355,
        0.017976}},  // foot_joint
      {-1.8692,
       {0.61664, -0.50516, -0.4251, -0.30727, 0.020474, -0.15774, -0.13647, -0.044052, 0.054961,
        -0.16608, -0.0074595, -0.017831, -0.034396, -0.011137, -0.047276, -0.026179,
        0.022662}},  // thigh_left_joint
      {0.2806,
       {-1.5601, -0.02514, -0.25089, -0.29455, 0.10179, 0.6671, -0.41133, 0.27113, 0.071244,
        -0.27885, -0.023993, 0.09358, 0.02937, 0.012767, 0.035677, -0.072556,
        0.013247}},  // leg_left_joint
      {-3.4206,
       {2.3035, -1.713, 0.015325, -0.059746, 0.18012, 1.127, -0.42575, 0.00033704, -0.079762,
        -0.0074, -0.038046, -0.045458, -0.0081246, 0.042746, 0.035299, -0.0098826,
        0.044041}},  // foot_left_joint
  };
}

}  // namespace

std::vector<Registration> registrations() {
  // Gymnasium's constants (gymnasium/envs/mujoco/walker2d_v4.py, walker2d_v5.py, 1.4.0).
  mujoco::LocomotionRobotKind kind;
  kind.name = "Walker2d";
  kind.model = "walker2d";
  kind.num_hinges = 6;
  kind.bodies = {"torso", "thigh", "leg", "foot", "thigh_left", "leg_left", "foot_left"};
  // RK4 is stable up to 2.78 armature / timestep = 13.9 N m s, whatever the masses are.
  kind.joint_damping = {0.1, 10};
  kind.push_impulse = 12;               // changes the velocity of its 23.7 kg by 0.5 m/s
  kind.leg_length = 0.45 + 0.5 + 0.06;  // thigh, leg, radius of the foot: lidar range 2.376 m
  kind.camera_distance = 4;
  kind.healthy_ranges = mujoco::torso_ranges("walker", {0.8, 2.0}, {-1.0, 1.0});
  kind.gait = gait();
  kind.make_physics = [](mujoco::ModelPointer model) {
    return mujoco::kernel::make_physics(kernels(), std::move(model));
  };
  return mujoco::registrations(std::move(kind));
}

}  // namespace walker::walker2d
