// A robot's world, stepped by MuJoCo's library.
#pragma once

#include "robots/mujoco/physics.h"

namespace walker::mujoco {

/// One state of MuJoCo's.
class LibraryPhysics : public Physics {
 public:
  /// @param why_not_faster for `stepper`; may be empty
  explicit LibraryPhysics(ModelPointer model, std::string why_not_faster = "");

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
  std::string why_not_faster_;
};

/// @throws std::runtime_error where there is no memory
DataPointer make_data(const mjModel& model);

/// mj_forward from a state as `Physics::save` has it: its accelerations, from which a later step
/// starts the solver, become those of its positions and velocities.
void forward(const mjModel& model, double* state);

/// Makes engine steps, and looks at their result as the next one would.
/// @param control nu values
void advance(const mjModel& model, mjData& data, const double* control, int count);

/// @throws std::runtime_error with the words of what MuJoCo has warned of since the last reset
void check_warnings(const mjData& data);

}  // namespace walker::mujoco
