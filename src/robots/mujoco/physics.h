// One simulated instance of a robot: its interface, and its implementation by MuJoCo's library.
#pragma once

#include <array>
#include <cstddef>
#include <exception>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "robots/mujoco/engine.h"
#include "robots/mujoco/floor.h"

namespace walker::mujoco {

class Physics;

/// Force and torque on a body at its frame's origin, in axes of the world.
struct BodyWrench {
  int body;
  std::array<double, 3> force;   ///< [N]
  std::array<double, 3> torque;  ///< [N m]
};

/// What acts on a robot besides its motors, constant over a call of `Physics::step`.
struct ExternalForces {
  /// Force on the trunk's origin: generalized force on the slides, the world's x and z [N]. The
  /// built-in trunks have their centre of mass there.
  std::array<double, 2> trunk{};
  const std::vector<BodyWrench>* wrenches = nullptr;  ///< those on a body add up; null: none
};

/// One instance's part of a `Physics::step_together` call.
struct PhysicsCall {
  Physics* physics = nullptr;
  const double* control = nullptr;
  ExternalForces forces;
  std::exception_ptr failure;  ///< what `step` would have thrown
};

/// The mutable state of an instance. Instances share the constant model, except those in worlds
/// with other physics.
class Physics {
 public:
  Physics() = default;
  Physics(const Physics&) = delete;
  Physics& operator=(const Physics&) = delete;
  virtual ~Physics() = default;

  virtual const mjModel& model() const = 0;

  /// Replaces the model. The state stays, unless one of the two models is of a world with a level.
  /// @param model the one of the constructor, or one with another world's values of the same base
  /// model
  virtual void set_model(ModelPointer model) = 0;

  /// Replaces the line that limbs touch. The next call must be `reset` or `load`.
  /// @param line of a world whose model has its floor raised (`WorldPhysics::has_level`), which
  ///             must live until the next call of `set_ground`; null: the floor is flat
  virtual void set_ground(const GroundLine* line) = 0;

  virtual const double* position() const = 0;  ///< nq values [m, rad]
  virtual const double* velocity() const = 0;  ///< nv values [m/s, rad/s]

  /// Sets the state and computes its accelerations. The next step starts the solver from them, so
  /// its result depends on them to the bit.
  /// @param position nq values [m, rad]
  /// @param velocity nv values [m/s, rad/s]
  /// @throws std::runtime_error with MuJoCo's message if the engine fails
  virtual void reset(const double* position, const double* velocity) = 0;

  /// Makes engine steps under a constant control and forces.
  /// @param control nu values; MuJoCo clamps them to the actuators' ranges
  /// @param forces  of this call only
  /// @throws std::runtime_error with MuJoCo's warning if the simulation is unstable; the state is
  ///         then lost
  virtual void step(const double* control, const ExternalForces& forces, int count) = 0;

  /// Makes engine steps of several instances, with the same results as `step`.
  /// @param calls of distinct instances, without a failure
  virtual void step_together(PhysicsCall* calls, std::size_t num_calls, int count) noexcept {
    for (PhysicsCall* call = calls; call != calls + num_calls; ++call) {
      try {
        call->physics->step(call->control, call->forces, count);
      } catch (...) {
        call->failure = std::current_exception();
      }
    }
  }

  /// Group size at which `step_together` is fastest.
  virtual std::size_t group_size() const { return 1; }

  /// Calls `look` with an mjData that has the poses and contacts of the current state; mj_step
  /// leaves those of the integrator's last stage. Does not affect later steps.
  virtual void measure(const std::function<void(const mjData&)>& look) const = 0;

  /// Writes everything that later steps, observations and measurements depend on: MuJoCo's qpos,
  /// qvel, qacc_warmstart, ctrl and qfrc_actuator. No robot here has activations, and nothing reads
  /// the time.
  /// @param values receives `state_size()` values
  virtual void save(double* values) const = 0;
  virtual void load(const double* values) = 0;
  std::size_t state_size() const {
    const int size = model().nq + 3 * model().nv + model().nu;
    return static_cast<std::size_t>(size);
  }

  /// Returns a short description of what makes the steps.
  virtual std::string stepper() const = 0;
};

/// @throws std::runtime_error if the allocation fails
DataPointer make_data(const mjModel& model);

/// An instance that mj_step advances. An engine step solves, for the accelerations a = dv/dt,
///
///   M(q) a + bias(q, v) = passive + actuator + applied + J' f
///
/// with the constraint forces f of contacts and limits, and integrates q and v over opt.timestep
/// (built-in models: RK4, kernel/runge_kutta.h). The terms are MuJoCo's qfrc_*:
///
///   actuator  gear * clamp(control, ctrlrange) on each motor's hinge [N m]
///   applied   `ExternalForces::trunk` on the trunk's slides [N]
///   wrench    xfrc_applied at the body's centre of mass: force, and torque + (origin - centre) x
///             force, computed anew before each engine step
///
/// State: mjData, of which `save` lists the part that later steps depend on.
///
/// Source: MuJoCo 2.2.2, mj_step, mj_forward, mj_checkPos, mj_checkVel (engine_forward.c);
/// Gymnasium 1.4.0, envs/mujoco/mujoco_env.py, _step_mujoco_simulation.
class LibraryPhysics : public Physics {
 public:
  /// @param fallback_reason reason why no kernel is used, for `stepper`; may be empty
  explicit LibraryPhysics(ModelPointer model, std::string fallback_reason = "")
      : model_(std::move(model)),
        data_(make_data(*model_)),
        fallback_reason_(std::move(fallback_reason)) {}

  const mjData& data() const { return *data_; }

  const mjModel& model() const override { return *model_; }
  void set_model(ModelPointer model) override;
  void set_ground(const GroundLine* line) override { line_ = line; }
  const double* position() const override { return data_->qpos; }
  const double* velocity() const override { return data_->qvel; }
  void reset(const double* position, const double* velocity) override;
  void step(const double* control, const ExternalForces& forces, int count) override;
  void measure(const std::function<void(const mjData&)>& look) const override;
  void save(double* values) const override;
  void load(const double* values) override;
  std::string stepper() const override {
    return "the library" + (fallback_reason_.empty() ? "" : ": " + fallback_reason_);
  }

 private:
  ModelPointer model_;
  DataPointer data_;
  std::string fallback_reason_;
  const GroundLine* line_ = nullptr;
};

/// Runs mj_forward on a state in the format of `Physics::save`. The accelerations at its positions
/// and velocities become its qacc_warmstart, from which a later step starts the solver.
/// @param line as of `Physics::set_ground`
void forward(const mjModel& model, const GroundLine* line, double* state);

/// Makes engine steps, then checks the result as the next step would.
/// @param control nu values
void advance(const mjModel& model, mjData& data, const double* control,
             const ExternalForces& forces, int count);

/// @throws std::runtime_error with MuJoCo's warning if a bad state occurred since the last reset
void check_warnings(const mjData& data);

}  // namespace walker::mujoco
