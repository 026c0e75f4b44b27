// Common base of Gymnasium's planar robots that MuJoCo simulates, such as Hopper and Walker2d.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "robots/mujoco/floor.h"
#include "robots/mujoco/level_ground.h"
#include "robots/mujoco/lidar.h"
#include "robots/mujoco/physics.h"
#include "robots/mujoco/planar_model.h"
#include "robots/mujoco/world_physics.h"
#include "robots/robot.h"
#include "walker_sim/observation_builder.h"

namespace walker::mujoco {

/// Options of a planar robot, except those of its reward and termination.
struct PlanarOptions {
  /// The robot's id, parameters, info names, reward threshold and time limit; the model gives the
  /// rest.
  Specification specification;
  PlanarModel model;
  std::vector<std::string> bodies;  ///< whose masses and forces on them a world can set
  /// Creates the physics; empty: MuJoCo's library.
  std::function<std::unique_ptr<Physics>(ModelPointer)> make_physics;
  int frame_skip = 1;            ///< engine steps per environment step
  double reset_noise_scale = 0;  ///< maximum deviation of a position or velocity at a reset
  bool exclude_current_positions_from_observation = true;
  bool include_lidar_in_observation = false;
  double lidar_range = 0;  ///< [m]; a world may set another one
  /// Bound to which observed velocities are clamped [m/s, rad/s].
  double velocity_limit = std::numeric_limits<double>::infinity();
};

Specification make_specification(const PlanarOptions& options, const Layout& layout,
                                 const mjModel& model);

/// Creates the builder for the environment with the same options.
/// @throws std::invalid_argument if the model is not a planar robot (two slides and a hinge)
std::unique_ptr<ObservationBuilder> make_observation_builder(const PlanarOptions& options);

/// Steps, observes and measures. Derived classes add reward and termination.
///
/// Model: a trunk on slides along the world's x and z and a hinge about y, and limbs on hinges with
/// one motor each; qpos = (x, z, pitch, hinges). With dt = frame_skip * opt.timestep:
///
///   reset        draws a level's ground; qpos = qpos0 + u; qvel = u, each u uniform in
///                +-reset_noise_scale
///   step         frame_skip engine steps (`Physics::step`) with the action as constant control:
///                torque = gear * clamp(action, ctrlrange) [N m]
///   push J       generalized force J / dt on the slides [N]
///   x_velocity   (x - x before the step) / dt
///   observation  qpos, by default without x; clamp(qvel, +-velocity_limit); with
///                include_lidar_in_observation also the lidar's ranges over lidar_range
///   sensors      linear velocity = qvel_x axis_x + qvel_z axis_z, linear acceleration = (this
///                velocity - that before the step) / dt
///
/// Inputs: action, push and wrenches, constant over a step. State: the physics' (qpos, qvel and the
/// solver's warm start), x and qvel before the step, the level's ground. Units: m, rad, kg, s.
///
/// Source: Gymnasium 1.4.0, envs/mujoco/mujoco_env.py, MujocoEnv.do_simulation;
/// walker2d_v5.py and hopper_v5.py, reset_model, step and _get_obs.
class PlanarRobot : public Robot {
 public:
  /// @throws std::invalid_argument if the model is not a planar robot (two slides and a hinge)
  explicit PlanarRobot(const PlanarOptions& options);

  const Specification& specification() const override { return specification_; }
  void set_world(const WorldValues& values) override;
  void change_physics(const WorldValues& values) override;
  void reset(Generator& generator, double* info) override;

  /// @throws std::runtime_error if the simulation is unstable
  void step(RobotStep& step) override;
  void step_group(RobotStep* const* steps, std::size_t count) noexcept override;
  std::size_t group_size() const override { return physics_->group_size(); }
  void observe(double* observation) const override;
  void observe(const SensorNoise& noise, double* observation) const override;
  void sense(Sensors& sensors) override;
  void scene(Scene& scene) const override;
  void save(StateWriter& writer) const override;
  std::function<void()> load(StateReader& reader, const WorldValues& values,
                             bool is_alive) override;
  void set_coordinates(const std::vector<double>& position, const std::vector<double>& velocity,
                       double* info) override;

 protected:
  /// The world's model.
  const mjModel& model() const { return physics_->model(); }
  /// Current values of MuJoCo's qpos and qvel.
  const double* position() const { return physics_->position(); }
  const double* velocity() const { return physics_->velocity(); }
  /// Heights of the ground and of obstacles below the trunk's origin, above the flat floor [m].
  GroundBelow ground_below() const;

 private:
  /// Writes the values that the info has after a reset; the others stay unchanged.
  virtual void write_reset_info(double* info) const = 0;

  /// Sets reward, info, termination and end reason.
  /// @param x_velocity of the trunk, mean over the step [m/s]
  /// @param step       its action is not clamped to the actuators' ranges
  virtual void conclude_step(double x_velocity, RobotStep& step) const = 0;

  std::uint64_t model_fingerprint() const;
  LidarRanges cast_rays(const mjData* data) const;
  LidarRanges cast_rays() const;
  void write_first_info(double* info) const;
  void remember_state();
  ExternalForces forces_of(const RobotStep& step);
  std::shared_ptr<const LevelGround> draw_ground(Generator& generator, const Level& level) const;
  void set_ground(const GeneratorState& origin, std::shared_ptr<const LevelGround> ground);
  const GroundLine* line() const { return ground_ ? &ground_->line() : nullptr; }
  void finish_step(RobotStep& step) const;

  PlanarOptions options_;
  WorldModels models_;
  std::shared_ptr<const LevelRefusal> level_refusal_;
  std::unique_ptr<Physics> physics_;
  std::optional<Level> level_;                 // of the world; empty: the floor is flat
  std::shared_ptr<const LevelGround> ground_;  // null before the first reset in a level
  GeneratorState ground_origin_{};             // generator state before the ground
  Layout layout_;
  Specification specification_;
  double lidar_range_;                        // in this world [m]
  std::vector<double> first_position_;        // initial qpos
  double x_before_step_ = 0;                  // x of the trunk
  std::vector<double> velocity_before_step_;  // MuJoCo's qvel
  std::vector<BodyWrench> wrenches_;          // of the present step
  mutable std::optional<std::uint64_t>
      model_fingerprint_;  // of the empty world's, computed at the first `save` or `load`
};

}  // namespace walker::mujoco
