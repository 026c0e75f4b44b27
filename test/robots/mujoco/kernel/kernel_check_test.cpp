// The selection of a kernel.
#include "robots/mujoco/kernel/kernel_physics.h"

#include <gtest/gtest.h>

#include "kernel_variable.h"
#include "robots/mujoco/kernel/altered.h"
#include "robots/mujoco/kernel/run.h"
#include "robots/mujoco/model.h"

namespace walker::mujoco::kernel {
namespace {

TEST(TrialTest, AcceptsEveryKernel) {
  for (const char* file :
       {"hopper_v4.xml", "hopper_v5.xml", "walker2d_v4.xml", "walker2d_v5.xml"}) {
    ASSERT_FALSE(robot_of(file).kernels.usable.empty());
    for (const Kernel* kernel : robot_of(file).kernels.usable) {
      EXPECT_TRUE(is_as_library(*kernel, *load_model(file))) << kernel->instruction_set;
    }
  }
}

TEST(TrialTest, RejectsAKernelWithOtherBits) {
  EXPECT_FALSE(is_as_library(kernel_with_fused_add, *load_model("walker2d_v5.xml")));
}

void flag_all(Instance* const* instances, std::size_t count, int /*steps*/) {
  for (std::size_t i = 0; i < count; ++i) instances[i]->is_flagged = true;
}

/// Such a kernel is correct, but slower than no kernel.
TEST(TrialTest, RejectsAKernelThatFlagsEverything) {
  const Kernel kernel{"none", 1, flag_all, flag_all,
                      [](Instance& instance) { instance.is_flagged = true; }};
  EXPECT_FALSE(is_as_library(kernel, *load_model("walker2d_v5.xml")));
}

TEST(TrialTest, ChoosesNoneForAnotherModel) {
  const KernelChoice choice =
      choose_kernel(robot_of("walker2d_v5.xml").kernels, *load_model("hopper_v5.xml"));
  EXPECT_EQ(choice.kernel, nullptr);
  EXPECT_EQ(choice.fallback_reason, "the model has another nq");
}

}  // namespace
}  // namespace walker::mujoco::kernel
