#include "robots/hopper/registration.h"

#include <limits>
#include <utility>

#include "robots/mujoco/kernel/kernel_physics.h"
#include "robots/mujoco/locomotion_robot.h"

namespace walker::hopper {
namespace {

/// Weights of a gait that hops through whole episodes of Hopper-v4 and v5, about 16 m in 8 s.
///
/// Found by augmented random search V2-t (reference in walker2d/registration.cpp) on Hopper-v5:
/// 60 updates, each from the best 20 of 40 directions, step size 0.03, noise 0.03.
std::vector<mujoco::MotorWeights> gait() {
  return {
      {-0.79736,
       {0.38921, -3.0115, -0.27563, 0.68445, -0.22567, 0.23987, -0.10152, -0.33925, -0.083277,
        0.04064, -0.025828}},  // thigh_joint
      {0.4402,
       {-0.7317, -2.9283, -0.40995, -1.034, 0.046376, 0.085682, 0.0082116, -0.38687, -0.053378,
        -0.17602, -0.020426}},  // leg_joint
      {-2.1981,
       {2.4008, -3.5984, 0.44211, -0.032361, -0.080808, -0.53917, 0.0037326, 0.14534, 0.14014,
        0.007087, 0.017716}},  // foot_joint
  };
}

}  // namespace

std::vector<Registration> registrations() {
  // Gymnasium's constants (gymnasium/envs/mujoco/hopper_v4.py, hopper_v5.py, 1.4.0).
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  mujoco::LocomotionRobotKind kind;
  kind.name = "Hopper";
  kind.model = "hopper";
  kind.num_hinges = 3;
  kind.bodies = {"torso", "thigh", "leg", "foot"};
  kind.joint_damping = {1, 100};  // RK4 is stable up to 1390; see walker2d/registration.cpp
  kind.push_impulse = 8;          // changes the velocity of its 15.8 kg by 0.5 m/s
  kind.reward_threshold = 3800;
  kind.leg_length = 0.45 + 0.5 + 0.06;  // as Walker2d's: lidar range 2.376 m
  kind.camera_distance = 3;
  kind.healthy_ranges = mujoco::torso_ranges("hopper", {0.7, kInfinity}, {-0.2, 0.2});
  const mujoco::HealthyRange state{
      "healthy_state_range",
      "rad, m/s, rad/s",
      "Interval of each value of a healthy hopper's state, from the torso's angle on.",
      {-100.0, 100.0},
      mujoco::kBasePitch,
      mujoco::kStateEnd,
      "a number of the state left healthy_state_range"};
  kind.healthy_ranges.insert(kind.healthy_ranges.begin(), state);
  kind.gait = gait();
  kind.make_physics = [](mujoco::ModelPointer model) {
    return mujoco::kernel::make_physics(kernels(), std::move(model));
  };
  return mujoco::registrations(std::move(kind));
}

}  // namespace walker::hopper
