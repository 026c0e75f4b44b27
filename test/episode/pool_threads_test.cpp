// Results are bit-identical for any kernel, and for any grouping of the walkers that it steps
// together, by any number of threads.
#include <gtest/gtest.h>

#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "episode/rollout.h"
#include "kernel_variable.h"
#include "simd/choose_kernel.h"
#include "test_name.h"

namespace walker {
namespace {

/// Instruction set of every processor of this architecture.
const char* last_set() {
  return simd::instruction_sets().empty() ? "off" : simd::instruction_sets().back().c_str();
}

class KernelPoolTest : public testing::TestWithParam<const char*> {
 protected:
  /// Returns the bits of all rows of 100 steps.
  static std::vector<std::uint64_t> play(const char* kernel, std::size_t num_threads,
                                         std::size_t num_envs, AutoresetMode mode) {
    const KernelVariable variable(kernel);
    Rollout rollout(GetParam(), {num_envs, num_threads, mode, 0});
    rollout.reset(0);
    std::mt19937 random(9);
    std::vector<std::uint64_t> all;
    for (int step = 0; step < 100; ++step) {
      rollout.step(random);
      for (std::size_t i = 0; i < num_envs; ++i) {
        const std::vector<std::uint64_t> row = rollout.row(i);
        all.insert(all.end(), row.begin(), row.end());
      }
    }
    return all;
  }
};

TEST_P(KernelPoolTest, IsTheSameForAllGroupings) {
  for (const AutoresetMode mode : kModes) {
    for (const std::size_t num_envs : {1U, 3U, 64U, 71U}) {
      const std::vector<std::uint64_t> expected = play("off", 1, num_envs, mode);
      ASSERT_EQ(play(last_set(), 1, num_envs, mode), expected) << num_envs;
      ASSERT_EQ(play(nullptr, 1, num_envs, mode), expected) << num_envs;
      ASSERT_EQ(play(nullptr, 3, num_envs, mode), expected) << num_envs;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Walkers, KernelPoolTest,
                         testing::Values("BipedalWalker-v3", "BipedalWalkerHardcore-v3",
                                         "Walker2d-v5"),
                         kNameOfId);

}  // namespace
}  // namespace walker
