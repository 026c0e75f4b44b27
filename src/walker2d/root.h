// The trunk between the world's frame and the model's joints.
#pragma once

#include "walker2d/mujoco.h"
#include "walker_sim/observation_builder.h"
#include "walker_sim/specification.h"

namespace walker::walker2d {

/// Tells the trunk's pose and twist as the model's three root joints count them.
class Root {
 public:
  explicit Root(const mjModel& model);

  /// @param origin      of the trunk in the world [m]
  /// @param orientation of the trunk in the world
  /// @param position    receives the root's part of MuJoCo's qpos, the pitch but for whole turns
  void locate(const Vector3& origin, const Quaternion& orientation, double* position) const;

  /// @param velocity receives the root's part of MuJoCo's qvel
  void move(const Measurements& measurements, double* velocity) const;

 private:
  void slide(const Vector3& vector, double* along) const;
  double turn_from_reference(const Quaternion& orientation) const;

  const mjModel& model_;
  int trunk_;
  Vector3 x_axis_{};  // of the slides, in the world
  Vector3 z_axis_{};
};

}  // namespace walker::walker2d
