#include "robots/mujoco/planar_base.h"

#include <array>
#include <cmath>

namespace walker::mujoco {

PlanarBase::PlanarBase(const mjModel& model) : model_(model), trunk_(model.jnt_bodyid[kBaseX]) {
  const mjtNum* const attitude = at(model.body_quat, trunk_, 4);
  mju_rotVecQuat(x_axis_.data(), at(model.jnt_axis, kBaseX, 3), attitude);
  mju_rotVecQuat(z_axis_.data(), at(model.jnt_axis, kBaseZ, 3), attitude);
}

void PlanarBase::locate(const Vector3& origin, const Quaternion& orientation,
                        double* position) const {
  // Joints start from the model's reference pose; the pitch hinge is at the trunk's origin.
  const mjtNum* const reference = at(model_.body_pos, trunk_, 3);
  Vector3 way{};
  for (std::size_t k = 0; k < 3; ++k) way[k] = origin[k] - reference[k];
  slide(way, position);
  position[kBasePitch] = turn_from_reference(orientation);
  for (int i = 0; i < kBaseJoints; ++i) position[i] += model_.qpos0[i];
}

void PlanarBase::move(const Measurements& measurements, double* velocity) const {
  const Quaternion& q = measurements.orientation;
  const std::array<mjtNum, 4> to_world{q[3], q[0], q[1], q[2]};
  Vector3 in_world{};
  mju_rotVecQuat(in_world.data(), measurements.linear_velocity.data(), to_world.data());
  slide(in_world, velocity);
  velocity[kBasePitch] =
      mju_dot3(measurements.angular_velocity.data(), at(model_.jnt_axis, kBasePitch, 3));
}

/// Decomposes a vector along the slides, whose axes are the world's x and z up to rounding.
void PlanarBase::slide(const Vector3& vector, double* along) const {
  const double determinant = x_axis_[0] * z_axis_[2] - x_axis_[2] * z_axis_[0];
  along[kBaseX] = (vector[0] * z_axis_[2] - vector[2] * z_axis_[0]) / determinant;
  along[kBaseZ] = (vector[2] * x_axis_[0] - vector[0] * x_axis_[2]) / determinant;
}

/// Returns the angle about the pitch hinge, modulo whole turns [rad].
double PlanarBase::turn_from_reference(const Quaternion& orientation) const {
  const std::array<mjtNum, 4> attitude{orientation[3], orientation[0], orientation[1],
                                       orientation[2]};
  std::array<mjtNum, 4> back{};
  std::array<mjtNum, 4> turn{};
  mju_negQuat(back.data(), at(model_.body_quat, trunk_, 4));
  mju_mulQuat(turn.data(), back.data(), attitude.data());
  return 2 * std::atan2(mju_dot3(&turn[1], at(model_.jnt_axis, kBasePitch, 3)), turn[0]);
}

}  // namespace walker::mujoco
