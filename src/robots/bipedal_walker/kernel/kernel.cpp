// The compilations of the kernel, and the choice of one that gives Box2D's bits on this machine.
#include "robots/bipedal_walker/kernel/kernel.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <deque>
#include <vector>

#include "base/bits.h"
#include "base/random.h"
#include "robots/bipedal_walker/physics.h"

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

/// Ground rougher than Gymnasium's, for contacts at all angles from the first steps on.
Ground rough_ground(Generator& generator) {
  Ground ground;
  ground.points.resize(kTerrainLength);
  for (std::size_t i = 0; i < ground.points.size(); ++i) {
    ground.points[i] = {static_cast<double>(i) * kTerrainStep,
                        kTerrainHeight + generator.uniform(-0.3, 0.3)};
  }
  return ground;
}

std::vector<std::byte> state_of(const Physics& physics) {
  std::vector<std::byte> bytes;
  StateWriter writer(bytes);
  physics.save(writer);
  return bytes;
}

/// Compares instances that the kernel steps, in a group and one alone, with identical instances
/// that Box2D steps.
bool has_steps_of_box2d(const Kernel& kernel) {
  constexpr int kSteps = 12;
  constexpr std::size_t kGroup = 19;  // the last group of lanes is not full
  constexpr std::size_t kInstances = kGroup + 1;
  Generator generator(0);
  std::deque<Physics> ours(kInstances);
  std::deque<Physics> plain(kInstances);
  for (std::size_t i = 0; i < kInstances; ++i) {
    const Ground ground = rough_ground(generator);
    const double push = generator.uniform(-50, 50);
    Dynamics dynamics;
    if (i % 2 != 0) {
      dynamics.gravity = generator.uniform(-20, 0);
      dynamics.mass_scale = generator.uniform(0.5, 2);
    }
    ours[i].build(ground, push, dynamics);
    plain[i].build(ground, push, dynamics);
  }
  std::array<std::exception_ptr, kInstances> failures;
  for (int step = 0; step < kSteps; ++step) {
    std::array<PhysicsCall, kInstances> calls;
    for (std::size_t i = 0; i < kInstances; ++i) {
      std::array<double, kJointCount> action{};
      for (double& value : action) value = generator.uniform(-1, 1);
      ours[i].drive(action.data());
      calls[i] = {&ours[i], &failures[i]};
      plain[i].drive(action.data());
      plain[i].step();
    }
    step_together(kernel, calls.data(), kGroup);
    step_together(kernel, &calls[kGroup], 1);
  }
  return std::equal(ours.begin(), ours.end(), plain.begin(),
                    [](const auto& a, const auto& b) { return state_of(a) == state_of(b); });
}

}  // namespace

std::vector<const Kernel*> kernels() {
#ifndef WALKER_SIM_HAS_KERNELS
  return {};
#elif defined(__aarch64__)
  return simd::usable_kernels<Kernel>({&kernel_neon});
#else
  return simd::usable_kernels<Kernel>({&kernel_avx512, &kernel_avx2, &kernel_sse2});
#endif
}

bool has_box2ds_bits(const Kernel& kernel) {
  return has_rotations_of_library(kernel) && has_steps_of_box2d(kernel);
}

KernelChoice choose_kernel() {
  return simd::choose_kernel(simd::allowed_kernels(kernels()), has_box2ds_bits);
}

}  // namespace walker::bipedal_walker
