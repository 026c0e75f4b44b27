// Worlds that a kernel solves in groups have Box2D's bits in all state that persists over steps.
// WALKER_SIM_TEST_STEPS sets the number of steps per mode (docs/box2d_speed.md).
#include "robots/bipedal_walker/kernel/kernel.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <limits>
#include <random>
#include <tuple>

#include "kernel_variable.h"
#include "robots/bipedal_walker/kernel/run.h"

namespace walker::bipedal_walker {
namespace {

/// @return the steps of all kernels, which must have Box2D's bits
Report compare_with_box2d(const RunOptions& options) {
  const std::vector<const Kernel*> all = kernels();
  EXPECT_FALSE(all.empty()) << "no kernel for this processor";
  const Report report = run(all, options);
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Tally& tally = report.tallies[i];
    EXPECT_EQ(tally.different, 0) << all[i]->instruction_set << " with " << options.worlds
                                  << " worlds: " << tally.first_different;
  }
  return report;
}

/// Other code solves a single world. Every other one of the random worlds is plain.
enum class Worlds { plain, single, random };

/// Mode, hardcore, reuse_world, worlds.
class KernelTest : public testing::TestWithParam<std::tuple<std::string, bool, bool, Worlds>> {};

TEST_P(KernelTest, HasBox2dsBits) {
  RunOptions options;
  Worlds worlds;
  std::tie(options.mode, options.hardcore, options.reuse_world, worlds) = GetParam();
  options.steps = num_test_steps(1000);
  options.random_worlds = worlds == Worlds::random;
  if (worlds == Worlds::single) options.worlds = 1;
  const bool falls_asleep = options.mode == "rest" && worlds != Worlds::random;
  if (falls_asleep && worlds == Worlds::plain) {  // enough steps to fall asleep
    options.worlds = 17;
    options.steps = std::max(options.steps, 180 * static_cast<long>(options.worlds));
  }
  const Report report = compare_with_box2d(options);
  ASSERT_GE(report.steps, options.steps);
  std::cout << report.steps << " steps each, " << report.resets << " resets, up to "
            << report.most_contacts << " contacts, " << report.failures
            << " assertions, asleep after " << report.sleeps << "\n";
  if (falls_asleep) {
    EXPECT_GT(report.sleeps, 0);
  }
}

INSTANTIATE_TEST_SUITE_P(Walkers, KernelTest,
                         testing::Combine(testing::ValuesIn(kModes), testing::Bool(),
                                          testing::Bool(),
                                          testing::Values(Worlds::plain, Worlds::single)));
INSTANTIATE_TEST_SUITE_P(Worlds, KernelTest,
                         testing::Combine(testing::ValuesIn(kModes), testing::Bool(),
                                          testing::Values(false), testing::Values(Worlds::random)));

TEST(KernelGroupTest, AnyNumberOfWorlds) {
  for (const bool random_worlds : {false, true}) {
    for (std::size_t worlds = 1; worlds <= kMaxGroupSize; worlds += worlds < 18 ? 1 : 5) {
      RunOptions options;
      options.mode = "saturated";
      options.random_worlds = random_worlds;
      options.worlds = worlds;
      options.steps = static_cast<long>((random_worlds ? 40 : 100) * worlds);
      compare_with_box2d(options);
    }
  }
}

const Kernel& original() { return *kernels().front(); }

Report run_altered(decltype(Kernel::solve) solve, decltype(Kernel::solve_toi) solve_toi,
                   const char* mode) {
  const Kernel kernel{"altered", original().lanes, solve, solve_toi, original().rotate};
  RunOptions options;
  options.mode = mode;
  options.hardcore = true;
  options.steps = 20000;
  return run({&kernel}, options);
}

/// One iteration less over velocities or positions.
template <int Model::*kIterations>
void solve_less(Island* const* islands, std::size_t count, const Model& model) {
  Model less = model;
  --(less.*kIterations);
  original().solve(islands, count, less);
}

/// Most islands converge long before the last iteration, so this kernel makes only 5.
void solve_toi_less(ToiIsland* const* islands, std::size_t count, const Model& model) {
  Model less = model;
  less.velocity_iterations = 5;
  original().solve_toi(islands, count, less);
}

TEST(KernelControlTest, FewerIterationsAreNoticed) {
  const auto count_different = [](auto solve, auto solve_toi, const char* mode) {
    return run_altered(solve, solve_toi, mode).tallies[0].different;
  };
  const Kernel& kernel = original();
  EXPECT_GT(count_different(solve_less<&Model::velocity_iterations>, kernel.solve_toi, "random"),
            0);
  EXPECT_GT(count_different(solve_less<&Model::position_iterations>, kernel.solve_toi, "random"),
            0);
  EXPECT_GT(count_different(kernel.solve, solve_toi_less, "saturated"), 0);
}

bool is_unlucky() {
  static std::mt19937 random(5);
  return random() % 3 == 0;
}

/// About one result in three is non-finite; Box2D then solves that world itself.
TEST(KernelFallbackTest, Box2dSolvesNonFiniteResults) {
  const auto solve = [](Island* const* islands, std::size_t count, const Model& model) {
    original().solve(islands, count, model);
    for (std::size_t i = 0; i < count; ++i) {
      if (is_unlucky()) islands[i]->bodies[i % kBodies].x = std::nanf("");
    }
  };
  const auto solve_toi = [](ToiIsland* const* islands, std::size_t count, const Model& model) {
    original().solve_toi(islands, count, model);
    for (std::size_t i = 0; i < count; ++i) {
      if (is_unlucky()) islands[i]->state.angle = std::numeric_limits<float>::infinity();
    }
  };
  for (const char* mode : {"random", "endless"}) {
    const Report report = run_altered(solve, solve_toi, mode);
    EXPECT_EQ(report.tallies[0].different, 0) << report.tallies[0].first_different;
  }
}

TEST(TrialTest, EveryKernelHasBox2dsBits) {
  ASSERT_FALSE(kernels().empty()) << "no kernel for this processor";
  for (const Kernel* kernel : kernels()) {
    EXPECT_TRUE(has_box2ds_bits(*kernel)) << kernel->instruction_set;
  }
}

TEST(TrialTest, RejectsOtherSteps) {
  Kernel kernel = original();
  kernel.solve = solve_less<&Model::velocity_iterations>;
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

TEST(TrialTest, ChoosesTheWidestKernelThatTheUserAllows) {
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
