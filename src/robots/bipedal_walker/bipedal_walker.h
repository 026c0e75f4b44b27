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
#include "base/random.h"
#include "walker_sim/environment.h"

namespace walker::bipedal_walker {

/// Gymnasium's BipedalWalker, to the bit: observations are float32 values, rewards float32 values
/// but for the constant -100 of a fall.
class BipedalWalker : public Environment {
 public:
  explicit BipedalWalker(const Options& options);

  const Specification& specification() const override { return *specification_; }
  void reset(std::optional<std::uint64_t> seed, Result& result) override;

  /// @throws std::runtime_error when Box2D fails an assertion; then only a reset is allowed
  void step(const double* action, std::size_t size, Result& result) override;
  /// By a kernel, where there is one (`specification().engine_version` says so).
  void step_together(StepCall* const* calls, std::size_t count, std::size_t size) noexcept override;
  std::size_t group_size() const override;
  void sense(Sensors& sensors) override;
  void scene(Scene& scene) const override;
  GeneratorState generator_state() const override;
  void set_generator_state(const GeneratorState& state) override;
  bool can_save_state() const override;
  void save_state(const Result& last, std::vector<std::byte>& state) const override;
  Progress load_state(const std::byte* state, std::size_t size, Result* last) override;

 private:
  friend class BrokenWorldTest;  // breaks the world

  void renew_world();
  bool has_world() const { return physics_ && !world_is_broken_; }
  void begin_step(const double* action);
  void finish_step(const double* action, Result& result);
  void advance(const double* action);
  std::exception_ptr break_world();
  void observe(double* observation) const;
  double score(const double* action);
  void judge(Result& result) const;

  Options options_;
  const Kernel* kernel_;  // of worlds that are stepped together; null: none
  std::shared_ptr<const Specification> specification_;
  std::optional<Generator> generator_;  // none before the first reset
  // None before the first reset. In place, for a world is 100 kB of which a step hardly touches
  // any: it takes no memory as long as nothing else has used its place.
  std::optional<Physics> physics_;
  bool world_is_broken_ = false;     // the engine failed: the next reset needs a new world
  GeneratorState terrain_origin_{};  // the generator's, from which terrain and clouds were drawn
  Terrain terrain_;
  Clouds clouds_{};
  LidarScan lidar_;
  Reward reward_;
  b2Vec2 velocity_before_step_{0, 0};  // of the hull's origin [m/s]
};

}  // namespace walker::bipedal_walker
