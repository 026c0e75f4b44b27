#include "hopper/registration.h"

#include <limits>

#include "hopper/gait.h"
#include "mujoco/healthy_robot.h"
#include "mujoco/planar_base.h"

namespace walker::hopper {
namespace {

/// Gymnasium's numbers (gymnasium/envs/mujoco/hopper_v4.py, hopper_v5.py, 1.4.0).
mujoco::HealthyRobotKind make_kind() {
  using mujoco::kBasePitch;
  using mujoco::kBaseZ;
  mujoco::HealthyRobotKind kind;
  kind.name = "Hopper";
  kind.robot = "hopper";
  kind.num_hinges = 3;
  kind.reward_threshold = 3800;
  kind.camera_distance = 3;
  kind.gait = gait;
  const int state_size = 2 * (mujoco::kBaseJoints + kind.num_hinges);
  kind.healthy_ranges = {
      {"healthy_state_range",
       "rad, m/s, rad/s",
       "Between these is each number of a healthy hopper's state, from the torso's angle on.",
       {-100.0, 100.0},
       kBasePitch,
       state_size,
       "a number of the state left healthy_state_range"},
      {"healthy_z_range",
       "m",
       "Heights of the torso between which the hopper is healthy.",
       {0.7, std::numeric_limits<double>::infinity()},
       kBaseZ,
       kBaseZ + 1,
       "the torso's height left healthy_z_range"},
      {"healthy_angle_range",
       "rad",
       "Angles of the torso between which the hopper is healthy.",
       {-0.2, 0.2},
       kBasePitch,
       kBasePitch + 1,
       "the torso's angle left healthy_angle_range"}};
  return kind;
}

}  // namespace

std::vector<Registration> registrations() {
  static const mujoco::HealthyRobotKind kHopper = make_kind();
  return mujoco::registrations(kHopper);
}

}  // namespace walker::hopper
