// The base of a planar robot: the three joints between its trunk and the world.
#pragma once

#include "robots/mujoco/engine.h"
#include "walker_sim/observation_builder.h"
#include "walker_sim/specification.h"

namespace walker::mujoco {

/// Number of the trunk's joints, the model's first: two slides and a hinge.
constexpr int kBaseJoints = 3;

/// Indices of the trunk's joints in MuJoCo's qpos and qvel.
enum BaseIndex { kBaseX, kBaseZ, kBasePitch };

/// Converts the trunk's pose and twist to coordinates of its three joints.
class PlanarBase {
 public:
  explicit PlanarBase(const mjModel& model);

  /// @param origin      of the trunk in the world [m]
  /// @param orientation of the trunk in the world
  /// @param position    receives the base's part of MuJoCo's qpos; the pitch is modulo whole turns
  void locate(const Vector3& origin, const Quaternion& orientation, double* position) const;

  /// @param velocity receives the base's part of MuJoCo's qvel
  void move(const Measurements& measurements, double* velocity) const;

 private:
  void slide(const Vector3& vector, double* along) const;
  double turn_from_reference(const Quaternion& orientation) const;

  const mjModel& model_;
  int trunk_;
  Vector3 x_axis_{};  // of the slides, in the world
  Vector3 z_axis_{};
};

}  // namespace walker::mujoco
