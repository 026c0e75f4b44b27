// A robot in a plane: what Gymnasium's Hopper, Walker2d and HalfCheetah have in common.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "robots/mujoco/layout.h"
#include "robots/mujoco/physics.h"
#include "robots/robot.h"

namespace walker::mujoco {

/// What distinguishes one such robot from another but its reward and its termination.
struct PlanarOptions {
  std::string id;
  std::vector<std::pair<std::string, ParameterValue>> parameters;  ///< complete, to be told
  PlanarModel model;
  /// What steps it; without this, the library.
  std::function<std::unique_ptr<Physics>(ModelPointer)> make_physics;
  int frame_skip = 1;            ///< engine steps a step
  double reset_noise_scale = 0;  ///< largest deviation of a position or velocity at a reset
  bool exclude_current_positions_from_observation = true;
  /// Observed velocities are clipped there [m/s, rad/s].
  double velocity_limit = std::numeric_limits<double>::infinity();
  std::vector<std::string> info_names;
  double reward_threshold = std::numeric_limits<double>::quiet_NaN();  ///< NaN: none
  std::uint32_t max_episode_steps = 0;  ///< for the specification; the episode enforces it
};

/// Positions, without the trunk's x where that is excluded, then velocities, these limited.
/// @param position, velocity MuJoCo's qpos and qvel
void write_observation(const mjModel& model, const PlanarOptions& options, const double* position,
                       const double* velocity, double* observation);

/// Steps, observes and measures; a robot adds reward and termination.
class PlanarRobot : public Robot {
 public:
  /// @throws std::invalid_argument if the model is not a planar robot (two slides and a hinge)
  explicit PlanarRobot(const PlanarOptions& options);

  const Specification& specification() const override { return specification_; }
  void reset(Generator& generator, double* info) override;

  /// @throws std::runtime_error if the simulation is unstable
  void step(RobotStep& step) override;
  void step_group(RobotStep* const* steps, std::size_t count) noexcept override;
  std::size_t group_size() const override { return physics_->group_size(); }
  void observe(double* observation) const override;
  void sense(Sensors& sensors) override;
  void scene(Scene& scene) const override;
  void save(StateWriter& writer) const override;
  std::function<void()> load(StateReader& reader) override;
  void set_coordinates(const std::vector<double>& position, const std::vector<double>& velocity,
                       double* info) override;

 protected:
  const mjModel& model() const { return physics_->model(); }
  /// MuJoCo's qpos and qvel, as they are now.
  const double* position() const { return physics_->position(); }
  const double* velocity() const { return physics_->velocity(); }

 private:
  /// What the info has right after a reset; all of it is absent before.
  virtual void write_reset_info(double* info) const = 0;

  /// Reward, info, and whether and why the step ends the episode.
  /// @param x_velocity of the trunk, mean over the step [m/s]
  /// @param step       its action is as given, not limited to the actuators' ranges
  virtual void conclude_step(double x_velocity, RobotStep& step) const = 0;

  std::uint64_t model_fingerprint() const;
  void draw_noise(Generator& generator, std::vector<double>& noise) const;
  void write_first_info(double* info) const;
  void remember_state();
  void finish_step(RobotStep& step) const;

  PlanarOptions options_;
  std::unique_ptr<Physics> physics_;
  Layout layout_;
  Specification specification_;
  std::vector<double> first_position_;        // of this episode
  double x_before_step_ = 0;                  // of the trunk
  std::vector<double> velocity_before_step_;  // MuJoCo's qvel
  mutable std::optional<std::uint64_t>
      model_fingerprint_;  // none before a state is saved or loaded
};

}  // namespace walker::mujoco
