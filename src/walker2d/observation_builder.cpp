#include "walker2d/observation_builder.h"

#include <array>
#include <cmath>

#include "core/measurements.h"
#include "core/unwrapped_angle.h"
#include "walker2d/model.h"
#include "walker2d/observation.h"
#include "walker2d/specification.h"

namespace walker::walker2d {
namespace {

/// The trunk's pose and twist as the model's three root joints count them.
class Root {
 public:
  explicit Root(const mjModel& model) : model_(model), trunk_(model.jnt_bodyid[kRootX]) {
    const mjtNum* const attitude = at(model.body_quat, trunk_, 4);
    mju_rotVecQuat(x_axis_.data(), at(model.jnt_axis, kRootX, 3), attitude);
    mju_rotVecQuat(z_axis_.data(), at(model.jnt_axis, kRootZ, 3), attitude);
  }

  void reset() { pitch_.reset(); }

  /// @param position, velocity receive the root's part of MuJoCo's qpos and qvel
  void locate(const Measurements& measurements, double* position, double* velocity) {
    // Joints count from the model's reference pose; the pitch hinge is at the trunk's origin.
    const mjtNum* const reference = at(model_.body_pos, trunk_, 3);
    Vector3 way{};
    for (std::size_t k = 0; k < 3; ++k) way[k] = measurements.position[k] - reference[k];
    slide(way, position);
    position[kRootPitch] = pitch_.follow(turn_from_reference(measurements.orientation));
    for (int i = 0; i < kRootJoints; ++i) position[i] += model_.qpos0[i];

    const Quaternion& q = measurements.orientation;
    const std::array<mjtNum, 4> to_world{q[3], q[0], q[1], q[2]};
    Vector3 in_world{};
    mju_rotVecQuat(in_world.data(), measurements.linear_velocity.data(), to_world.data());
    slide(in_world, velocity);
    velocity[kRootPitch] =
        mju_dot3(measurements.angular_velocity.data(), at(model_.jnt_axis, kRootPitch, 3));
  }

 private:
  /// Along the two slides, whose axes are the world's x and z but for the model's rounding.
  void slide(const Vector3& vector, double* along) const {
    const double determinant = x_axis_[0] * z_axis_[2] - x_axis_[2] * z_axis_[0];
    along[kRootX] = (vector[0] * z_axis_[2] - vector[2] * z_axis_[0]) / determinant;
    along[kRootZ] = (vector[2] * x_axis_[0] - vector[0] * x_axis_[2]) / determinant;
  }

  /// About the pitch hinge, but for whole turns [rad].
  double turn_from_reference(const Quaternion& q) const {
    const std::array<mjtNum, 4> attitude{q[3], q[0], q[1], q[2]};
    std::array<mjtNum, 4> back{};
    std::array<mjtNum, 4> turn{};
    mju_negQuat(back.data(), at(model_.body_quat, trunk_, 4));
    mju_mulQuat(turn.data(), back.data(), attitude.data());
    return 2 * std::atan2(mju_dot3(&turn[1], at(model_.jnt_axis, kRootPitch, 3)), turn[0]);
  }

  const mjModel& model_;
  int trunk_;
  Vector3 x_axis_{};  // of the slides, in the world
  Vector3 z_axis_{};
  UnwrappedAngle pitch_;
};

class Builder : public ObservationBuilder {
 public:
  explicit Builder(const Options& options)
      : model_(load_model(options.xml_file)),
        layout_(*model_),
        specification_(make_specification(options, layout_, *model_)),
        exclude_x_(options.exclude_current_positions_from_observation),
        root_(*model_) {}

  void reset() override { root_.reset(); }

  void build(const Measurements& measurements, double* observation) override {
    check_measurements(measurements, specification_);
    check_finite("position[0]", measurements.position[0], "m");
    check_finite("position[2]", measurements.position[2], "m");
    std::array<double, kDegreesOfFreedom> position{};
    std::array<double, kDegreesOfFreedom> velocity{};
    root_.locate(measurements, position.data(), velocity.data());
    for (std::size_t i = 0; i < layout_.joints.size(); ++i) {
      position[model_->jnt_qposadr[layout_.joints[i]]] = measurements.joint_position[i];
      velocity[model_->jnt_dofadr[layout_.joints[i]]] = measurements.joint_velocity[i];
    }
    write_observation(position.data(), velocity.data(), exclude_x_, observation);
  }

 private:
  ModelPointer model_;
  Layout layout_;
  Specification specification_;
  bool exclude_x_;
  Root root_;
};

}  // namespace

std::unique_ptr<ObservationBuilder> make_observation_builder(const Options& options) {
  return std::make_unique<Builder>(options);
}

}  // namespace walker::walker2d
