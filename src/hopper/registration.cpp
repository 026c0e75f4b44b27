#include "hopper/registration.h"

#include <limits>

#include "hopper/gait.h"
#include "mujoco/healthy_robot.h"
#include "mujoco/planar_base.h"

namespace walker::hopper {
namespace {

/// Gymnasium's numbers (gymnasium/envs/mujoco/hopper_v4.py, hopper_v5.py, 1.4.0).
mujoco::HealthyRobotKind make_kind() {
  mujoco::HealthyRobotKind kind;
  kind.name = "Hopper";
  kind.robot = "hopper";
  kind.num_hinges = 3;
  kind.reward_threshold = 3800;
  kind.camera_distance = 3;
  kind.gait = gait;
  const int state_size = 2 * (mujoco::kBaseJoints + kind.num_hinges);
  const double infinity = std::numeric_limits<double>::infinity();
  kind.healthy_ranges = {
      {"healthy_state_range",
       "rad, m/s, rad/s",
       "Between these is each number of a healthy hopper's state, from the torso's angle on.",
       {-100.0, 100.0},
       mujoco::kBasePitch,
       state_size,
       "a number of the state left healthy_state_range"},
      mujoco::height_range("hopper", 0.7, infinity),
      mujoco::angle_range("hopper", -0.2, 0.2)};
  return kind;
}

}  // namespace

std::vector<Registration> registrations() {
  static const mujoco::HealthyRobotKind kHopper = make_kind();
  return mujoco::registrations(kHopper);
}

}  // namespace walker::hopper
