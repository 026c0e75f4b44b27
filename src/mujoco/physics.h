// A robot's world: one model, one state, stepped by MuJoCo.
#pragma once

#include "mujoco/engine.h"

namespace walker::mujoco {

/// Owns the mutable state; the model is shared and constant.
class Physics {
 public:
  explicit Physics(ModelPointer model);

  const mjModel& model() const { return *model_; }
  const mjData& data() const { return *data_; }

  /// Puts the robot into a state and computes its accelerations, which later steps start their
  /// solver from: they are part of the bits.
  /// @param position nq values [m, rad]
  /// @param velocity nv values [m/s, rad/s]
  /// @throws std::runtime_error with MuJoCo's words when it gives up
  void reset(const double* position, const double* velocity);

  /// Makes engine steps under a constant control.
  /// @param control nu values; MuJoCo limits them to the actuators' ranges
  /// @throws std::runtime_error with MuJoCo's words when the simulation is unstable; the state is
  ///         then lost
  void step(const double* control, int count);

  /// Brings poses and contacts up to the present state. After a step they are those of the
  /// integrator's last stage. Changes nothing that a later step depends on.
  void measure();

 private:
  void check_warnings() const;

  ModelPointer model_;
  DataPointer data_;
};

}  // namespace walker::mujoco
