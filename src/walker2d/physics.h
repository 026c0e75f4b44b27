// The walker's world: one model, one state, stepped by MuJoCo.
#pragma once

#include "walker2d/constants.h"
#include "walker2d/mujoco.h"

namespace walker::walker2d {

/// Owns the mutable state; the model is shared and constant.
class Physics {
 public:
  explicit Physics(ModelPointer model);

  const mjModel& model() const { return *model_; }
  const mjData& data() const { return *data_; }

  /// Puts the walker into a state and computes its accelerations, which later steps start their
  /// solver from: they are part of the bits.
  /// @param position, velocity kDegreesOfFreedom values [m, rad, m/s, rad/s]
  /// @throws std::runtime_error with MuJoCo's words when it gives up
  void reset(const double* position, const double* velocity);

  /// Makes engine steps under a constant control.
  /// @param control kJointCount values; MuJoCo limits them to the actuators' ranges
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

}  // namespace walker::walker2d
