// Physics stepped by MuJoCo's library.
#pragma once

#include "robots/mujoco/physics.h"

namespace walker::mujoco {

class LibraryPhysics : public Physics {
 public:
  /// @param fallback_reason reason why no kernel is used, for `stepper`; may be empty
  explicit LibraryPhysics(ModelPointer model, std::string fallback_reason = "");

  const mjData& data() const { return *data_; }

  const mjModel& model() const override { return *model_; }
  const double* position() const override { return data_->qpos; }
  const double* velocity() const override { return data_->qvel; }
  void reset(const double* position, const double* velocity) override;
  void step(const double* control, int count) override;
  void measure(const std::function<void(const mjData&)>& look) const override;
  void save(double* values) const override;
  void load(const double* values) override;
  std::string stepper() const override;

 private:
  ModelPointer model_;
  DataPointer data_;
  std::string fallback_reason_;
};

/// @throws std::runtime_error if the allocation fails
DataPointer make_data(const mjModel& model);

/// Runs mj_forward on a state in the format of `Physics::save`. The accelerations at its positions
/// and velocities become its qacc_warmstart, from which a later step starts the solver.
void forward(const mjModel& model, double* state);

/// Makes engine steps, then checks the result as the next step would.
/// @param control nu values
void advance(const mjModel& model, mjData& data, const double* control, int count);

/// @throws std::runtime_error with MuJoCo's warning if a bad state occurred since the last reset
void check_warnings(const mjData& data);

}  // namespace walker::mujoco
