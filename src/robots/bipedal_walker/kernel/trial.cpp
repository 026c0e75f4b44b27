#include "robots/bipedal_walker/kernel/trial.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <vector>

#include "base/bits.h"
#include "base/random.h"
#include "robots/bipedal_walker/physics.h"
#include "robots/bipedal_walker/together.h"

namespace walker::bipedal_walker {
namespace {

/// Tests enough angles: one sine in some thousands differs if the C library rounds differently.
bool has_rotations_of_library(const Kernel& kernel) {
  constexpr int kAngles = 20000;
  std::vector<float> angles(kAngles);
  Generator generator(0);
  for (float& angle : angles) {
    const double exponent = generator.uniform(-16, 5);
    angle = static_cast<float>(std::exp2(exponent) * (generator.uniform(-1, 1) < 0 ? -1 : 1));
  }
  std::vector<Rotation<float>> rotations(kAngles);
  kernel.rotate(angles.data(), angles.size(), rotations.data());
  for (std::size_t i = 0; i < angles.size(); ++i) {
    if (to_bits(rotations[i].sine) != to_bits(std::sin(angles[i])) ||
        to_bits(rotations[i].cosine) != to_bits(std::cos(angles[i]))) {
      return false;
    }
  }
  return true;
}

/// Terrain rougher than Gymnasium's, for contacts at all angles from the first steps on.
Terrain rough_ground(Generator& generator) {
  Terrain terrain;
  for (std::size_t i = 0; i < terrain.ground.size(); ++i) {
    terrain.ground[i] = {static_cast<double>(i) * kTerrainStep,
                         kTerrainHeight + generator.uniform(-0.3, 0.3)};
  }
  return terrain;
}

bool is_same(const b2Body& one, const b2Body& other) {
  const auto numbers = [](const b2Body& body) {
    return std::array<float, 8>{body.GetPosition().x,       body.GetPosition().y,
                                body.GetTransform().q.s,    body.GetWorldCenter().x,
                                body.GetWorldCenter().y,    body.GetLinearVelocity().x,
                                body.GetLinearVelocity().y, body.GetAngularVelocity()};
  };
  const auto a = numbers(one);
  const auto b = numbers(other);
  return std::equal(a.begin(), a.end(), b.begin(),
                    [](float x, float y) { return to_bits(x) == to_bits(y); });
}

/// Steps worlds by the kernel and identical worlds by Box2D.
class KernelComparison {
 public:
  explicit KernelComparison(const Kernel& kernel)
      : kernel_(kernel), ours_(kWorlds), plain_(kWorlds) {
    for (std::size_t i = 0; i < kWorlds; ++i) {
      const Terrain terrain = rough_ground(generator_);
      const double push = generator_.uniform(-50, 50);
      for (auto* physics : {&ours_[i], &plain_[i]}) {
        *physics = std::make_unique<Physics>();
        (*physics)->build(terrain, push);
      }
    }
  }

  /// @return whether all bodies have the same bits
  bool step() {
    std::vector<WorldCall> calls(kWorlds);
    for (std::size_t i = 0; i < kWorlds; ++i) {
      std::array<double, kJointCount> action{};
      for (double& value : action) value = generator_.uniform(-1, 1);
      ours_[i]->drive(action.data());
      plain_[i]->drive(action.data());
      plain_[i]->step();
      calls[i].physics = ours_[i].get();
    }
    step_together(kernel_, calls.data(), calls.size());
    return std::equal(
        ours_.begin(), ours_.end(), plain_.begin(), [](const auto& ours, const auto& plain) {
          const auto a = ours->parts().bodies;
          const auto b = plain->parts().bodies;
          return std::equal(a.begin(), a.end(), b.begin(),
                            [](const b2Body* x, const b2Body* y) { return is_same(*x, *y); });
        });
  }

 private:
  static constexpr std::size_t kWorlds = 19;  // the last group of lanes is not full

  const Kernel& kernel_;
  Generator generator_{0};
  std::vector<std::unique_ptr<Physics>> ours_;
  std::vector<std::unique_ptr<Physics>> plain_;
};

}  // namespace

bool has_box2ds_bits(const Kernel& kernel) {
  constexpr int kSteps = 12;
  if (!has_rotations_of_library(kernel)) return false;
  KernelComparison comparison(kernel);
  for (int i = 0; i < kSteps; ++i) {
    if (!comparison.step()) return false;
  }
  return true;
}

KernelChoice choose_kernel() {
  return simd::choose_kernel(simd::allowed_kernels(kernels()), has_box2ds_bits);
}

}  // namespace walker::bipedal_walker
