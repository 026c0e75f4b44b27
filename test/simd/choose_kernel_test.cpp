#include "simd/choose_kernel.h"

#include <gtest/gtest.h>

#include <utility>

#include "error_message.h"
#include "kernel_variable.h"

namespace walker::simd {
namespace {

/// Each test has its own type, because a kernel's test runs once per process.
template <int>
struct FakeKernel {
  const char* instruction_set;
};

/// Kernels for every instruction set of this processor except the first, and for an unknown set.
template <int kTest>
const std::vector<const FakeKernel<kTest>*>& compiled() {
  static const std::vector<FakeKernel<kTest>> kKernels = [] {
    std::vector<FakeKernel<kTest>> kernels{{"sse1000"}};
    for (const std::string& set : instruction_sets()) {
      if (set != instruction_sets().front()) kernels.push_back({set.c_str()});
    }
    return kernels;
  }();
  static const std::vector<const FakeKernel<kTest>*> kPointers = [] {
    std::vector<const FakeKernel<kTest>*> pointers;
    for (const auto& kernel : kKernels) pointers.insert(pointers.begin(), &kernel);
    return pointers;
  }();
  return kPointers;
}

std::vector<std::string> sets_of(const std::vector<const FakeKernel<0>*>& kernels) {
  std::vector<std::string> sets;
  sets.reserve(kernels.size());
  for (const auto* kernel : kernels) sets.emplace_back(kernel->instruction_set);
  return sets;
}

class ChooseKernelTest : public testing::Test {
 protected:
  void SetUp() override {
    if (instruction_sets().size() < 2) GTEST_SKIP() << "this processor has not two sets";
    fewer_.assign(instruction_sets().begin() + 1, instruction_sets().end());
  }

  std::vector<std::string> fewer_;
};

TEST_F(ChooseKernelTest, UsesTheWidestSetThatIsAllowed) {
  const std::vector<std::string>& all = instruction_sets();
  EXPECT_EQ(sets_of(usable_kernels(compiled<0>())), fewer_);
  const std::vector<std::pair<const char*, std::vector<std::string>>> cases{
      {nullptr, fewer_},
      {all.front().c_str(), fewer_},  // no kernel for this set: the next best
      {all.back().c_str(), {all.back()}},
      {"off", {}}};
  for (const auto& [value, sets] : cases) {
    const KernelVariable variable(value);
    const auto allowed = allowed_kernels(usable_kernels(compiled<0>()));
    EXPECT_EQ(sets_of(allowed.kernels), sets);
    EXPECT_EQ(allowed.fallback_reason == "WALKER_SIM_KERNEL is off", sets.empty());
  }
}

TEST_F(ChooseKernelTest, RejectsUnknownSets) {
  const KernelVariable variable("sse3");
  const std::string message =
      message_of<std::invalid_argument>([] { allowed_kernels(usable_kernels(compiled<0>())); });
  EXPECT_EQ(message.rfind("WALKER_SIM_KERNEL = sse3: must be one of off, ", 0), 0U) << message;
  EXPECT_NE(message.find(", sse2, or not set"), std::string::npos) << message;
}

TEST_F(ChooseKernelTest, ReportsAProcessorWithoutKernels) {
  const KernelVariable variable(nullptr);
  const auto choice = choose_kernel(allowed_kernels<FakeKernel<1>>({}),
                                    [](const FakeKernel<1>& /*kernel*/) { return true; });
  EXPECT_EQ(choice.kernel, nullptr);
  EXPECT_EQ(choice.fallback_reason, "there is no kernel for this processor");
}

TEST_F(ChooseKernelTest, ChoosesTheFirstThatPassesAndTestsItOnce) {
  const KernelVariable variable(nullptr);
  const auto allowed = allowed_kernels(usable_kernels(compiled<2>()));
  int trials = 0;
  const auto passes_with_sse2 = [&trials](const FakeKernel<2>& kernel) {
    ++trials;
    return kernel.instruction_set == std::string("sse2");
  };
  for (int i = 0; i < 3; ++i) {
    const auto choice = choose_kernel(allowed, passes_with_sse2);
    ASSERT_NE(choice.kernel, nullptr);
    EXPECT_EQ(choice.kernel->instruction_set, std::string("sse2"));
  }
  EXPECT_EQ(trials, static_cast<int>(allowed.kernels.size()));
}

TEST_F(ChooseKernelTest, ReportsThatNonePasses) {
  const KernelVariable variable(nullptr);
  const auto choice = choose_kernel(allowed_kernels(usable_kernels(compiled<3>())),
                                    [](const FakeKernel<3>& /*kernel*/) { return false; });
  EXPECT_EQ(choice.kernel, nullptr);
  EXPECT_EQ(choice.fallback_reason,
            "the kernel's results differ from the engine's on this machine");
}

}  // namespace
}  // namespace walker::simd
