// BipedalWalker-v3: observation, reward and termination on top of the physics.
#pragma once

#include <exception>
#include <memory>
#include <optional>
#include <vector>

#include "robots/bipedal_walker/kernel/kernel.h"
#include "robots/bipedal_walker/lidar.h"
#include "robots/bipedal_walker/observation.h"
#include "robots/bipedal_walker/physics.h"
#include "robots/bipedal_walker/reward.h"
#include "robots/bipedal_walker/specification.h"
#include "robots/bipedal_walker/terrain.h"
#include "robots/robot.h"

namespace walker::bipedal_walker {

/// Gymnasium's BipedalWalker, to the bit: observations are float32 values, rewards float32 values
/// but for the constant -100 of a fall.
class BipedalWalker : public Robot {
 public:
  explicit BipedalWalker(const Options& options);

  const Specification& specification() const override { return *specification_; }
  void reset(Generator& generator, double* info) override;

  /// @throws std::runtime_error if Box2D fails an assertion
  void step(RobotStep& step) override;
  /// By a kernel, if there is one (`specification().engine_version` says so).
  void step_group(RobotStep* const* steps, std::size_t count) noexcept override;
  std::size_t group_size() const override { return kernel_ != nullptr ? kMaxGroupSize : 1; }
  void observe(double* observation) const override;
  void sense(Sensors& sensors) override;
  void scene(Scene& scene) const override;
  void save(StateWriter& writer) const override;
  std::function<void()> load(StateReader& reader) override;

 private:
  friend class BrokenWorldTest;  // breaks the world

  void renew_world();
  bool has_world() const { return physics_ && !world_is_broken_; }
  void begin_step(const double* action);
  void finish_step(RobotStep& step);
  void advance(const double* action);
  std::exception_ptr break_world();
  double reward(const double* action);
  const char* end_reason() const;

  Options options_;
  const Kernel* kernel_;  // of worlds that are stepped together; null: none
  std::shared_ptr<const Specification> specification_;
  // None before the first reset. In place, for a world is 100 kB of which a step hardly touches
  // any: it takes no memory as long as nothing else has used its place.
  std::optional<Physics> physics_;
  bool world_is_broken_ = false;     // the engine failed: the next reset makes a new world
  GeneratorState terrain_origin_{};  // of the generator before it drew terrain and clouds
  Terrain terrain_;
  Clouds clouds_{};
  LidarScan lidar_;
  Reward reward_;
  b2Vec2 velocity_before_step_{0, 0};  // of the hull's origin [m/s]
};

}  // namespace walker::bipedal_walker
