// Worlds with different kernels and models in one group.
#include <gtest/gtest.h>

#include <vector>

#include "bits.h"
#include "kernel_variable.h"
#include "robots/mujoco/model.h"
#include "robots/walker2d/kernel/kernel.h"
#include "robots/walker2d/kernel/kernel_physics.h"

namespace walker::walker2d {
namespace {

constexpr int kSize = 9;
constexpr int kMotors = 6;

using State = std::vector<double>;

/// The kernel variable or the model file may change while environments are made.
TEST(KernelPoolTest, WorldsOfOtherKindsAreSteppedApart) {
  const mujoco::ModelPointer model = mujoco::load_model("walker2d_v5.xml");
  const mujoco::ModelPointer other_model = mujoco::load_model("walker2d_v4.xml");
  const auto make_by_each = [&] {
    std::vector<std::unique_ptr<mujoco::Physics>> all;
    for (const char* kernel : {"sse2", "off", kernels().front()->instruction_set}) {
      const KernelVariable variable(kernel);
      all.push_back(make_kernel_physics(model));
      all.push_back(make_kernel_physics(other_model));
    }
    return all;
  };
  const auto together = make_by_each();
  const auto apart = make_by_each();
  const State velocity(kSize, 0.3);
  for (const auto* all : {&together, &apart}) {
    for (const auto& physics : *all) physics->reset(model->qpos0, velocity.data());
  }
  const State control(kMotors, 0.7);
  std::vector<mujoco::PhysicsCall> calls(together.size());
  for (int step = 0; step < 100; ++step) {
    for (std::size_t i = 0; i < calls.size(); ++i)
      calls[i] = {together[i].get(), control.data(), {}};
    together[step % calls.size()]->step_together(calls.data(), calls.size(), 4);
    for (std::size_t i = 0; i < calls.size(); ++i) {
      ASSERT_FALSE(calls[i].failure);
      apart[i]->step(control.data(), 4);
      for (int k = 0; k < kSize; ++k) {
        ASSERT_EQ(to_bits(together[i]->position()[k]), to_bits(apart[i]->position()[k]));
      }
    }
  }
}

}  // namespace
}  // namespace walker::walker2d
