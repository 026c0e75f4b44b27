// The kernel's bits against the library's. WALKER_SIM_TEST_STEPS sets the number of steps per mode
// (docs/mujoco_speed.md).
#include "robots/mujoco/kernel/kernel.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <iostream>
#include <random>
#include <tuple>
#include <utility>

#include "bits.h"
#include "robots/mujoco/kernel/altered.h"
#include "robots/mujoco/kernel/kernel_physics.h"
#include "robots/mujoco/kernel/run.h"
#include "robots/mujoco/random_level.h"
#include "robots/mujoco/world_physics.h"
#include "test_steps.h"

namespace walker::mujoco::kernel {
namespace {

/// Maximum share of steps that a kernel may leave to the library; in walks and falls none, or few
/// at the limits of an instance's physics. The limbs of a hopper touch each other when it lies on
/// the floor, and rarely after a violent start or on a level.
double allowed_share(const TestedRobot& robot, const std::string& mode, Instances instances) {
  if (mode == "wild") return 0.2;
  if (mode == "extreme" || mode == "rest" || mode == "tiny") return 1;
  if (mode == "endless" && robot.limbs_can_touch) return 0.1;
  const bool may_be_few =
      instances != Instances::plain || (mode == "violent" && robot.limbs_can_touch);
  return may_be_few ? 0.002 : 0;
}

class KernelTest : public testing::TestWithParam<std::tuple<std::string, std::string, Instances>> {
};

TEST_P(KernelTest, HasTheLibrarysBits) {
  const auto [file, mode, instances] = GetParam();
  const TestedRobot& robot = robot_of(file);
  const std::vector<Contestant> all = contestants(robot);
  ASSERT_FALSE(all.empty()) << "no kernel for this processor";
  const long steps = num_test_steps(2500);
  const Report report = run(all, file, mode, instances, steps);
  ASSERT_GE(report.steps, steps);
  std::cout << report.steps << " steps each, up to " << report.most_contacts << " contacts, "
            << report.warnings << " warnings, limbs touched each other in "
            << report.steps_with_limb_contacts << '\n';
  if (mode == "wild") {
    EXPECT_EQ(report.steps_with_limb_contacts > 0, robot.limbs_can_touch);
  }
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Tally& tally = report.tallies[i];
    std::cout << all[i].name << ": " << tally.different << " differ, " << tally.flagged
              << " left to the library\n";
    EXPECT_EQ(tally.different, 0) << all[i].name << ": " << tally.first_different;
    EXPECT_EQ(tally.missed, 0) << all[i].name;
    EXPECT_LE(tally.flagged,
              allowed_share(robot, mode, instances) * static_cast<double>(report.steps))
        << all[i].name;
  }
}

std::string name_of(const testing::TestParamInfo<KernelTest::ParamType>& info) {
  const std::string file = std::get<0>(info.param);
  constexpr std::array<const char*, 3> kSuffixes{"", "_altered", "_in_levels"};
  return file.substr(0, file.find('.')) + "_" + std::get<1>(info.param) +
         kSuffixes.at(static_cast<std::size_t>(std::get<2>(info.param)));
}

INSTANTIATE_TEST_SUITE_P(Walkers, KernelTest,
                         testing::Combine(testing::Values("hopper_v4.xml", "hopper_v5.xml",
                                                          "walker2d_v4.xml", "walker2d_v5.xml"),
                                          testing::ValuesIn(modes()),
                                          testing::Values(Instances::plain)),
                         name_of);
INSTANTIATE_TEST_SUITE_P(Instances, KernelTest,
                         testing::Combine(testing::Values("hopper_v5.xml", "walker2d_v5.xml"),
                                          testing::ValuesIn(modes()),
                                          testing::Values(Instances::altered,
                                                          Instances::in_levels)),
                         name_of);

TEST(KernelControlTest, DetectsMinimalErrors) {
  for (const auto& [kernel, steps] : {std::pair(&kernel_with_folded_pow, 5000),  //
                                      std::pair(&kernel_with_fused_add, 1000)}) {
    const Report report =
        run({{"", kernel, kernel->step}}, "walker2d_v5.xml", "random", Instances::plain, steps);
    EXPECT_GT(report.tallies[0].different, 0) << kernel->instruction_set;
  }
}

class KernelGroupTest : public testing::TestWithParam<const char*> {
 protected:
  std::vector<Instance> draw(const Kernel& kernel, std::size_t count) {
    std::uniform_real_distribution<double> unit(-1, 1);
    std::vector<Instance> instances(count);
    for (Instance& instance : instances) {
      for (double& value : instance.position) value = 0.5 * unit(random_);
      for (double& value : instance.velocity) value = 5 * unit(random_);
      instance.position[1] += 1.1;
      instance.values = &values_[random_() % values_.size()];
      if (random_() % 3 != 0) {
        const LevelGround& ground = grounds_[random_() % grounds_.size()];
        instance.position[0] += 50 + 40 * unit(random_);
        instance.position[1] += ground.below(instance.position[0]).top;
        instance.line = &ground.line();
      }
      kernel.start(instance);
      for (double& value : instance.torque) value = 100 * unit(random_);
      for (double& value : instance.push) value = random_() % 2 == 0 ? 1000 * unit(random_) : 0;
    }
    return instances;
  }

  static void expect_same(const Instance& one, const Instance& other) {
    EXPECT_EQ(one.is_flagged, other.is_flagged);
    EXPECT_EQ(one.pattern, other.pattern);
    for (const auto part : {&Instance::position, &Instance::velocity, &Instance::warm_start}) {
      for (std::size_t i = 0; i < kMaxCoordinates; ++i) {
        EXPECT_EQ(to_bits((one.*part)[i]), to_bits((other.*part)[i]));
      }
    }
  }

  std::mt19937_64 random_{3};
  std::vector<ModelValues<double>> values_ = several_values();
  std::vector<LevelGround> grounds_ = several_grounds();

 private:
  static std::vector<LevelGround> several_grounds() {
    std::vector<LevelGround> all;
    Generator random(2);
    for (int i = 0; i < 9; ++i) {
      const WorldValues values = random_level(random);
      all.emplace_back(random, *level_of(values), Point{0, 0});
    }
    return all;
  }

  /// Values of both models, and of instances.
  static std::vector<ModelValues<double>> several_values() {
    std::vector<ModelValues<double>> all;
    for (const char* version : {"_v4.xml", "_v5.xml"}) {
      WorldModels models(load_model(GetParam() + std::string(version)));
      for (const WorldValues& instance : std::vector<WorldValues>{
               {},
               {{"gravity", -2}, {"joint_damping", 1}},
               {{"mass_scale", 3}},
               {{"torso_mass", 0.1}, {"foot_mass", 6}, {"floor_friction", 3}}}) {
        all.push_back(values_of(*models.model_of(physics_of(instance))));
      }
    }
    return all;
  }
};

/// Groups mix models, instances, levels and the floor.
TEST_P(KernelGroupTest, ResultsAreIndependentOfTheGroup) {
  for (const Kernel* kernel : robot_of(GetParam()).kernels.usable) {
    for (std::size_t count = 1; count <= 40; ++count) {
      SCOPED_TRACE(kernel->instruction_set + (" of " + std::to_string(count)));
      std::vector<Instance> together = draw(*kernel, count);
      std::vector<Instance> apart = together;
      std::vector<Instance*> pointers(count);
      std::transform(together.begin(), together.end(), pointers.begin(),
                     [](Instance& instance) { return &instance; });
      std::shuffle(pointers.begin(), pointers.end(), random_);
      kernel->step(pointers.data(), count, 3);
      for (std::size_t i = 0; i < count; ++i) {
        Instance* const instance = &apart[i];
        kernel->step_singly(&instance, 1, 3);
        expect_same(*instance, together[i]);
      }
      if (HasFailure()) return;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Walkers, KernelGroupTest, testing::Values("hopper", "walker2d"));

}  // namespace
}  // namespace walker::mujoco::kernel
