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

#include "base/random.h"
#include "robots/mujoco/layout.h"
#include "robots/mujoco/physics.h"
#include "walker_sim/environment.h"

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
  std::uint32_t max_episode_steps = 0;  ///< for the specification; EpisodeRules enforces it
};

/// Positions, without the trunk's x where that is excluded, then velocities, these limited.
/// @param position, velocity MuJoCo's qpos and qvel
void write_observation(const mjModel& model, const PlanarOptions& options, const double* position,
                       const double* velocity, double* observation);

/// Stepped, observed and measured; what a step is worth, and when the episode ends, a robot adds.
class PlanarRobot : public Environment {
 public:
  /// @throws std::invalid_argument when the model is none of such a robot
  explicit PlanarRobot(const PlanarOptions& options);

  const Specification& specification() const override { return specification_; }
  void reset(std::optional<std::uint64_t> seed, Result& result) override;

  /// @throws std::runtime_error when the simulation is unstable; then only a reset is allowed
  void step(const double* action, std::size_t size, Result& result) override;
  void step_together(StepCall* const* calls, std::size_t count, std::size_t size) noexcept override;
  std::size_t group_size() const override { return physics_->group_size(); }
  void sense(Sensors& sensors) override;
  void scene(Scene& scene) const override;
  GeneratorState generator_state() const override;
  void set_generator_state(const GeneratorState& state) override { generator_.emplace(state); }
  bool can_save_state() const override { return true; }
  void save_state(const Result& last, std::vector<std::byte>& state) const override;
  Progress load_state(const std::byte* state, std::size_t size, Result* last) override;
  void set_coordinates(const std::vector<double>& position, const std::vector<double>& velocity,
                       Result& result) override;

 protected:
  const mjModel& model() const { return physics_->model(); }
  /// MuJoCo's qpos and qvel, as they are now.
  const double* position() const { return physics_->position(); }
  const double* velocity() const { return physics_->velocity(); }

 private:
  /// What the info has right after a reset; all of it is absent before.
  virtual void write_reset_info(double* info) const = 0;

  /// Reward, info, and whether and why the step ends the episode.
  /// @param action     as given, not limited to the actuators' ranges
  /// @param x_velocity of the trunk, mean over the step [m/s]
  virtual void conclude_step(const double* action, double x_velocity, Result& result) const = 0;

  std::uint64_t model_fingerprint() const;
  void draw_noise(std::vector<double>& noise);
  void write_first_result(Result& result) const;
  void remember_state();
  void finish_step(const double* action, Result& result) const;

  PlanarOptions options_;
  std::unique_ptr<Physics> physics_;
  Layout layout_;
  Specification specification_;
  std::optional<Generator> generator_;        // none before the first reset
  std::vector<double> first_position_;        // of this episode
  double x_before_step_ = 0;                  // of the trunk
  std::vector<double> velocity_before_step_;  // MuJoCo's qvel
  mutable std::optional<std::uint64_t>
      model_fingerprint_;  // none before a state is saved or loaded
};

}  // namespace walker::mujoco
