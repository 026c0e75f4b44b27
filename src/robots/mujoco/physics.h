// A robot's world: what is stepped.
#pragma once

#include <cstddef>
#include <exception>
#include <functional>
#include <memory>
#include <string>

#include "robots/mujoco/engine.h"

namespace walker::mujoco {

class Physics;

/// One of several worlds that are stepped together.
struct PhysicsCall {
  Physics* physics = nullptr;
  const double* control = nullptr;
  std::exception_ptr failure;  ///< what `step` would have thrown
};

/// The mutable state; the model is shared and constant.
class Physics {
 public:
  Physics() = default;
  Physics(const Physics&) = delete;
  Physics& operator=(const Physics&) = delete;
  virtual ~Physics() = default;

  virtual const mjModel& model() const = 0;
  virtual const double* position() const = 0;  ///< nq values [m, rad]
  virtual const double* velocity() const = 0;  ///< nv values [m/s, rad/s]

  /// Puts the robot into a state and computes its accelerations, which later steps start their
  /// solver from: they are part of the bits.
  /// @param position nq values [m, rad]
  /// @param velocity nv values [m/s, rad/s]
  /// @throws std::runtime_error with MuJoCo's words when it gives up
  virtual void reset(const double* position, const double* velocity) = 0;

  /// Makes engine steps under a constant control.
  /// @param control nu values; MuJoCo limits them to the actuators' ranges
  /// @throws std::runtime_error with MuJoCo's words when the simulation is unstable; the state is
  ///         then lost
  virtual void step(const double* control, int count) = 0;

  /// Makes engine steps of several worlds, each as `step` does it.
  /// @param calls without a failure yet; of distinct worlds
  virtual void step_together(PhysicsCall* calls, std::size_t num_calls, int count) noexcept;

  /// How many worlds `step_together` best takes.
  virtual std::size_t group_size() const { return 1; }

  /// Shows MuJoCo's data with the poses and contacts of the present state. After a step the
  /// library's own are those of the integrator's last stage. Changes nothing that a later step
  /// depends on.
  virtual void measure(const std::function<void(const mjData&)>& look) const = 0;

  /// All that later steps, observations and measurements depend on, as MuJoCo has it: qpos, qvel,
  /// qacc_warmstart, ctrl and qfrc_actuator; no robot of ours has activations, and nothing reads
  /// the time.
  /// @param values `state_size()` of them
  virtual void save(double* values) const = 0;
  virtual void load(const double* values) = 0;
  std::size_t state_size() const;

  /// What makes the steps, in a few words.
  virtual std::string stepper() const = 0;
};

}  // namespace walker::mujoco
