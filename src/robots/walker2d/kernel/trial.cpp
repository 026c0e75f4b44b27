#include "robots/walker2d/kernel/trial.h"

#include <algorithm>
#include <vector>

#include "base/bits.h"
#include "base/random.h"
#include "robots/mujoco/library_physics.h"
#include "robots/walker2d/kernel/coverage.h"
#include "robots/walker2d/kernel/trigonometry.h"

namespace walker::walker2d {
namespace {

World world_of(const mjModel& model, const mjData& data) {
  World world;
  read_state(data, world);
  for (std::size_t i = 0; i < World::kMotors; ++i) {
    world.torque[i] = mujoco::at(model.actuator_gear, static_cast<int>(i), 6)[0] * data.ctrl[i];
  }
  return world;
}

/// Steps the same worlds with the kernel and with the library.
class KernelCheck {
 public:
  KernelCheck(const Kernel& kernel, const mjModel& model)
      : kernel_(kernel), model_(model), ground_(ground_of(model)) {
    for (int i = 0; i < kWorlds; ++i) begin(static_cast<double>(i) / kWorlds);
  }

  void step() {
    std::vector<World> together;
    together.reserve(data_.size());
    for (const mujoco::DataPointer& each : data_) {
      std::generate_n(each->ctrl, World::kMotors, [this] { return generator_.uniform(-1, 1); });
      together.push_back(world_of(model_, *each));
    }
    std::vector<World> singly = together;
    std::vector<World*> worlds(together.size());
    std::transform(together.begin(), together.end(), worlds.begin(), [](World& w) { return &w; });
    kernel_.step(worlds.data(), worlds.size(), 1, ground_);
    for (std::size_t i = 0; i < data_.size(); ++i) {
      World* const world = &singly[i];
      kernel_.step_singly(&world, 1, 1, ground_);
      mj_step(&model_, data_[i].get());
      compare(together[i], *data_[i]);
      compare(*world, *data_[i]);
    }
  }

  /// Whether no result differed and few were flagged.
  bool has_passed() const { return num_different_ == 0 && num_equal_ > 10 * num_flagged_; }

 private:
  static constexpr int kWorlds = 19;  // leaves the last group of lanes incomplete

  /// Adds a world. With the wildness the state goes from standing to extreme, also below the floor.
  void begin(double wildness) {
    World world;
    for (std::size_t i = 0; i < World::kSize; ++i) {
      world.position[i] = wildness * generator_.uniform(-2, 2);
      world.velocity[i] = 10 * wildness * generator_.uniform(-1, 1);
    }
    world.position[1] = 1.25 + wildness * generator_.uniform(-1.25, 0);
    data_.push_back(mujoco::make_data(model_));
    mjData& data = *data_.back();
    std::copy(world.position.begin(), world.position.end(), data.qpos);
    std::copy(world.velocity.begin(), world.velocity.end(), data.qvel);
    mj_forward(&model_, &data);
    kernel_.start(world, ground_);
    compare(world, data);
  }

  void compare(const World& world, const mjData& data) {
    int& count = has_state(world, data) ? num_equal_ : num_different_;
    ++(world.is_flagged ? num_flagged_ : count);
  }

  const Kernel& kernel_;
  const mjModel& model_;
  Ground ground_;
  Generator generator_{0};
  std::vector<mujoco::DataPointer> data_;
  int num_equal_ = 0;
  int num_different_ = 0;
  int num_flagged_ = 0;
};

}  // namespace

void read_state(const mjData& data, World& world) {
  std::copy_n(data.qpos, World::kSize, world.position.begin());
  std::copy_n(data.qvel, World::kSize, world.velocity.begin());
  std::copy_n(data.qacc_warmstart, World::kSize, world.warm_start.begin());
}

bool has_state(const World& world, const mjData& data) {
  const auto is_equal = [](const auto& ours, const mjtNum* theirs) {
    return std::equal(ours.begin(), ours.end(), theirs,
                      [](double a, double b) { return to_bits(a) == to_bits(b); });
  };
  return is_equal(world.position, data.qpos) && is_equal(world.velocity, data.qvel) &&
         is_equal(world.warm_start, data.qacc_warmstart);
}

bool is_as_library(const Kernel& kernel, const mjModel& model) {
  constexpr int kSteps = 12;
  KernelCheck check(kernel, model);
  for (int i = 0; i < kSteps; ++i) check.step();
  return check.has_passed();
}

KernelChoice choose_kernel(const mjModel& model) {
  const simd::AllowedKernels<Kernel> allowed = simd::allowed_kernels(kernels());
  const std::string other_field = unsupported_reason(model);
  if (!other_field.empty()) return {nullptr, "the model has another " + other_field};
  return simd::choose_kernel(allowed, [&model](const Kernel& kernel) {
    choose_sine_and_cosine();
    return is_as_library(kernel, model);
  });
}

}  // namespace walker::walker2d
