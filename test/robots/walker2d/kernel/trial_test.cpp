// The selection of a kernel.
#include "robots/walker2d/kernel/kernel_physics.h"

#include <gtest/gtest.h>

#include "kernel_variable.h"
#include "robots/mujoco/model.h"
#include "robots/walker2d/kernel/altered.h"

namespace walker::walker2d {
namespace {

TEST(TrialTest, AcceptsEveryKernel) {
  ASSERT_FALSE(kernels().empty());
  for (const char* file : {"walker2d_v4.xml", "walker2d_v5.xml"}) {
    for (const Kernel* kernel : kernels()) {
      EXPECT_TRUE(is_as_library(*kernel, *mujoco::load_model(file))) << kernel->instruction_set;
    }
  }
}

TEST(TrialTest, RejectsAKernelWithOtherBits) {
  EXPECT_FALSE(is_as_library(kernel_with_fused_add, *mujoco::load_model("walker2d_v5.xml")));
}

void flag_all(World* const* worlds, std::size_t count, int /*steps*/) {
  for (std::size_t i = 0; i < count; ++i) worlds[i]->is_flagged = true;
}

/// Such a kernel is correct, but slower than no kernel.
TEST(TrialTest, RejectsAKernelThatFlagsEverything) {
  const Kernel kernel{"none", 1, flag_all, flag_all, [](World& world) { world.is_flagged = true; }};
  EXPECT_FALSE(is_as_library(kernel, *mujoco::load_model("walker2d_v5.xml")));
}

TEST(TrialTest, ChoosesTheFirstKernelThatTheUserAllows) {
  const mujoco::ModelPointer model = mujoco::load_model("walker2d_v5.xml");
  {
    const KernelVariable variable(nullptr);
    EXPECT_EQ(choose_kernel(*model).kernel, kernels().front());
    EXPECT_EQ(choose_kernel(*model).fallback_reason, "");
  }
  for (const Kernel* kernel : kernels()) {
    const KernelVariable variable(kernel->instruction_set);
    EXPECT_EQ(choose_kernel(*model).kernel, kernel);
  }
  const KernelVariable variable("off");
  EXPECT_EQ(choose_kernel(*model).kernel, nullptr);
  EXPECT_EQ(choose_kernel(*model).fallback_reason, "WALKER_SIM_KERNEL is off");
}

TEST(TrialTest, ChoosesNoneForAnotherModel) {
  const KernelChoice choice = choose_kernel(*mujoco::load_model("hopper_v5.xml"));
  EXPECT_EQ(choice.kernel, nullptr);
  EXPECT_EQ(choice.fallback_reason, "the model has another nq");
}

}  // namespace
}  // namespace walker::walker2d
