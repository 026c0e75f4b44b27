#include "walker2d/registration.h"

#include "mujoco/healthy_robot.h"
#include "walker2d/gait.h"

namespace walker::walker2d {
namespace {

/// Gymnasium's numbers (gymnasium/envs/mujoco/walker2d_v4.py, walker2d_v5.py, 1.4.0).
mujoco::HealthyRobotKind make_kind() {
  mujoco::HealthyRobotKind kind;
  kind.name = "Walker2d";
  kind.robot = "walker2d";
  kind.num_hinges = 6;
  kind.camera_distance = 4;
  kind.gait = gait;
  kind.healthy_ranges = {mujoco::height_range("walker", 0.8, 2.0),
                         mujoco::angle_range("walker", -1.0, 1.0)};
  return kind;
}

}  // namespace

std::vector<Registration> registrations() {
  static const mujoco::HealthyRobotKind kWalker2d = make_kind();
  return mujoco::registrations(kWalker2d);
}

}  // namespace walker::walker2d
