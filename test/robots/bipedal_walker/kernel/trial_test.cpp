// The selection of a kernel.
#include "robots/bipedal_walker/kernel/trial.h"

#include <gtest/gtest.h>

#include <cmath>

#include "kernel_variable.h"

namespace walker::bipedal_walker {
namespace {

const Kernel& original() { return *kernels().front(); }

TEST(TrialTest, EveryKernelHasBox2dsBits) {
  ASSERT_FALSE(kernels().empty());
  for (const Kernel* kernel : kernels())
    EXPECT_TRUE(has_box2ds_bits(*kernel)) << kernel->instruction_set;
}

TEST(TrialTest, RejectsOtherSteps) {
  Kernel kernel = original();
  kernel.solve = [](Island* const* islands, std::size_t count, const Model& model) {
    Model less = model;
    --less.velocity_iterations;
    original().solve(islands, count, less);
  };
  EXPECT_FALSE(has_box2ds_bits(kernel));
}

/// One sine in a thousand is wrong by one unit in the last place, as in another C library.
TEST(TrialTest, RejectsOtherRotations) {
  Kernel kernel = original();
  kernel.rotate = [](const float* angles, std::size_t count, Rotation<float>* rotations) {
    original().rotate(angles, count, rotations);
    for (std::size_t i = 0; i < count; i += 1000) {
      rotations[i].sine = std::nextafter(rotations[i].sine, 2.0F);
    }
  };
  EXPECT_FALSE(has_box2ds_bits(kernel));
}

TEST(TrialTest, ChoosesTheFirstKernelThatTheUserAllows) {
  {
    const KernelVariable variable(nullptr);
    EXPECT_EQ(choose_kernel().kernel, &original());
  }
  for (const Kernel* kernel : kernels()) {
    const KernelVariable variable(kernel->instruction_set);
    EXPECT_EQ(choose_kernel().kernel, kernel);
  }
  const KernelVariable variable("off");
  EXPECT_EQ(choose_kernel().kernel, nullptr);
  EXPECT_EQ(choose_kernel().fallback_reason, "WALKER_SIM_KERNEL is off");
}

}  // namespace
}  // namespace walker::bipedal_walker
