// Walker2d: observation, reward and termination on top of the physics.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "core/random.h"
#include "walker2d/layout.h"
#include "walker2d/physics.h"
#include "walker2d/reward.h"
#include "walker_sim/environment.h"

namespace walker::walker2d {

/// What a constructor may choose.
struct Options {
  std::string id;
  bool is_v5 = true;  ///< v5's info; v4's is shorter, and empty at a reset
  std::string xml_file;
  int frame_skip = kFrameSkip;
  RewardOptions reward{};
  std::array<double, 2> healthy_z_range{};      ///< open interval [m]
  std::array<double, 2> healthy_angle_range{};  ///< open interval [rad]
  double reset_noise_scale = 0;
  bool exclude_current_positions_from_observation = true;
  std::uint32_t max_episode_steps = 0;  ///< for the specification; EpisodeRules enforces it
};

/// Places in v5's info. v4's has the position and the velocity only.
enum InfoIndex : std::size_t {
  kPositionX,
  kDistanceZ,
  kVelocityX,
  kRewardForward,
  kRewardControl,
  kRewardSurvive
};

/// Gymnasium's Walker2d-v4 and v5, to the bit: observations, rewards and info are doubles.
class Walker2d : public Environment {
 public:
  /// @throws std::invalid_argument when the model is none
  explicit Walker2d(const Options& options);

  const Specification& specification() const override { return specification_; }
  void reset(std::optional<std::uint64_t> seed, Result& result) override;

  /// @throws std::runtime_error when the simulation is unstable; then only a reset is allowed
  void step(const double* action, std::size_t size, Result& result) override;
  void sense(Sensors& sensors) override;
  void scene(Scene& scene) const override;
  GeneratorState generator_state() const override;
  void set_generator_state(const GeneratorState& state) override;

 private:
  using State = std::array<double, kDegreesOfFreedom>;

  State draw_noise();
  void observe(double* observation) const;
  void tell_state(double* info) const;
  void score(const double* action, double x_velocity, bool is_healthy, Result& result) const;
  const char* why_unhealthy() const;

  Options options_;
  Physics physics_;
  Layout layout_;
  Specification specification_;
  std::optional<Generator> generator_;  // none before the first reset
  State velocity_before_step_{};        // MuJoCo's qvel
};

}  // namespace walker::walker2d
