// Computes a planar robot's observation from its sensors' measurements.
#include <vector>

#include "base/checks.h"
#include "base/unwrapped_angle.h"
#include "robots/mujoco/planar_base.h"
#include "robots/mujoco/planar_robot.h"
#include "robots/mujoco/specification.h"

namespace walker::mujoco {
namespace {

class Builder : public ObservationBuilder {
 public:
  explicit Builder(const PlanarOptions& options)
      : options_(options),
        model_(load_planar_model(options.model)),
        layout_(*model_),
        specification_(make_specification(options, layout_, *model_)),
        base_(*model_),
        position_(model_->nq),
        velocity_(model_->nv) {}

  void reset() override { pitch_.reset(); }

  void build(const Measurements& measurements, double* observation) override {
    check_measurements(measurements, specification_);
    check_finite("position[0]", measurements.position[0], " m");
    check_finite("position[2]", measurements.position[2], " m");
    base_.locate(measurements.position, measurements.orientation, position_.data());
    const double start = model_->qpos0[kBasePitch];
    position_[kBasePitch] = start + pitch_.follow(position_[kBasePitch] - start);
    base_.move(measurements, velocity_.data());
    for (std::size_t i = 0; i < layout_.joints.size(); ++i) {
      position_[model_->jnt_qposadr[layout_.joints[i]]] = measurements.joint_position[i];
      velocity_[model_->jnt_dofadr[layout_.joints[i]]] = measurements.joint_velocity[i];
    }
    write_observation(*model_, options_, position_.data(), velocity_.data(), observation);
  }

 private:
  PlanarOptions options_;
  ModelPointer model_;
  Layout layout_;
  Specification specification_;
  PlanarBase base_;
  UnwrappedAngle pitch_;
  std::vector<double> position_;  // MuJoCo's qpos
  std::vector<double> velocity_;  // MuJoCo's qvel
};

}  // namespace

std::unique_ptr<ObservationBuilder> make_observation_builder(const PlanarOptions& options) {
  return std::make_unique<Builder>(options);
}

}  // namespace walker::mujoco
