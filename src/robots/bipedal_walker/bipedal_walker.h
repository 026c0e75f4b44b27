// BipedalWalker-v3: observation, reward and termination on top of the physics.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "robots/bipedal_walker/kernel/kernel.h"
#include "robots/bipedal_walker/observation.h"
#include "robots/bipedal_walker/physics.h"
#include "robots/bipedal_walker/specification.h"
#include "robots/bipedal_walker/world_settings.h"
#include "robots/robot.h"

namespace walker::bipedal_walker {

/// Gymnasium's BipedalWalker, to the bit. Observations are float32 values; so are rewards, except
/// for the constant -100 of a fall.
///
/// Inputs: the action, for hip and knee of leg 1, then of leg 2. Its sign is the direction of the
/// joint's motor, its magnitude (at most 1) a fraction of the torque limit (`Physics::drive`).
/// State: `Physics`, the shaping, the last lidar scan, the hull's velocity before the step.
///
/// A step drives the motors, advances the world by dt = 1/50 s and casts the lidar. With the hull's
/// x [m] and angle [rad]:
///
///   shaping    = 130 x / 30 - 5 |angle|
///   reward     = (shaping - the last step's shaping) - 0.028 sum_i min(|action_i|, 1)
///   fall       = the hull has touched the ground, or x < 0
///   reward     = -100 on a fall
///   terminated = fall, or x > (200 - 10) 14/30 m
///
/// 0.028 is 0.00035 times the motors' 80 N m. A reset draws ground, clouds and the push on the
/// hull, builds the world, and makes a step of zero action, whose shaping is the first one.
///
/// Source: Gymnasium 1.4.0, envs/box2d/bipedal_walker.py, BipedalWalker.reset and step.
class BipedalWalker : public Robot {
 public:
  /// @param parameters complete
  BipedalWalker(const std::string& id, const Parameters& parameters);

  const Specification& specification() const override { return *specification_; }
  void set_world(const WorldValues& values) override;
  void change_physics(const WorldValues& values) override;
  void reset(Generator& generator, double* info) override;

  /// @throws std::runtime_error if Box2D fails an assertion
  void step(RobotStep& step) override;
  /// Steps by a kernel, if one is available; `specification().engine_version` names it.
  void step_group(RobotStep* const* steps, std::size_t count) noexcept override;
  std::size_t group_size() const override { return kernel_ != nullptr ? kMaxGroupSize : 1; }
  void observe(double* observation) const override;
  void observe(const SensorNoise& noise, double* observation) const override;
  void sense(Sensors& sensors) override;
  void scene(Scene& scene) const override;
  void save(StateWriter& writer) const override;
  std::function<void()> load(StateReader& reader, const WorldValues& values,
                             bool is_alive) override;

 private:
  friend class BrokenWorldTest;  // simulates a failed assertion

  void begin_episode(Generator& generator);
  void build_world(double push, bool reuse);
  void begin_step(const RobotStep& step);
  void finish_step(RobotStep& step);
  Observed observed() const;

  bool is_hardcore_;
  bool reuses_world_;
  const Kernel* kernel_;  // steps a group of instances; null if none is available
  std::shared_ptr<const Specification> specification_;
  // Empty before the first reset and after a failure. Stored in place: a step touches little of a
  // world's 100 KiB, and untouched pages of a fresh allocation take up no memory.
  std::optional<Physics> physics_;
  GeneratorState ground_origin_{};  // generator state before ground and clouds
  WorldSettings next_world_;        // of the resets to come
  WorldSettings world_;             // of this episode
  Ground ground_;
  Clouds clouds_{};
  LidarScan lidar_;
  std::optional<double> shaping_;      // of the reward
  b2Vec2 velocity_before_step_{0, 0};  // velocity of the hull's origin [m/s]
};

}  // namespace walker::bipedal_walker
