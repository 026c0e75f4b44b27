#include "walker2d/observation_builder.h"

#include <array>

#include "core/measurements.h"
#include "core/unwrapped_angle.h"
#include "walker2d/model.h"
#include "walker2d/observation.h"
#include "walker2d/root.h"
#include "walker2d/specification.h"

namespace walker::walker2d {
namespace {

class Builder : public ObservationBuilder {
 public:
  explicit Builder(const Options& options)
      : model_(load_model(options.xml_file)),
        layout_(*model_),
        specification_(make_specification(options, layout_, *model_)),
        exclude_x_(options.exclude_current_positions_from_observation),
        root_(*model_) {}

  void reset() override { pitch_.reset(); }

  void build(const Measurements& measurements, double* observation) override {
    check_measurements(measurements, specification_);
    check_finite("position[0]", measurements.position[0], "m");
    check_finite("position[2]", measurements.position[2], "m");
    std::array<double, kDegreesOfFreedom> position{};
    std::array<double, kDegreesOfFreedom> velocity{};
    root_.locate(measurements.position, measurements.orientation, position.data());
    const double start = model_->qpos0[kRootPitch];
    position[kRootPitch] = start + pitch_.follow(position[kRootPitch] - start);
    root_.move(measurements, velocity.data());
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
  UnwrappedAngle pitch_;
};

}  // namespace

std::unique_ptr<ObservationBuilder> make_observation_builder(const Options& options) {
  return std::make_unique<Builder>(options);
}

}  // namespace walker::walker2d
