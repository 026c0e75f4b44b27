// Saved states of MuJoCo robots: from the kernel to the library and back, sensors, and refusals.
#include <gtest/gtest.h>

#include <tuple>

#include "foreign_locale.h"
#include "kernel_variable.h"
#include "robots/mujoco/model_file.h"
#include "robots/mujoco/player.h"
#include "saved_states.h"
#include "test_name.h"

namespace walker::mujoco {
namespace {

/// Id, kernel that saves, kind of actions, one of which is in worlds that the loaders do not have.
class SavedStateTest
    : public testing::TestWithParam<std::tuple<std::string, const char*, std::string>> {};

TEST_P(SavedStateTest, HasTheSameFutureByTheOther) {
  const auto& [id, saver, kind] = GetParam();
  const char* const loader = saver == nullptr ? "off" : nullptr;
  const auto num_joints = static_cast<int>(make(id)->specification().action_size());
  World world;
  if (kind == "balance") {
    world = {{"gravity", {-12, -5}},    {"mass_scale", {0.8, 1.5}},
             {"thigh_mass", {2, 6}},    {"floor_friction", {1, 3}},
             {"lidar_range", {1, 4}},   {"friction_scale", {0.3, 2}},
             {"joint_damping", {0, 1}}, {"motor_strength", {0.8, 1.2}}};
  }
  expect_same_future(
      [&id = id, &saver = saver, &world] {
        Stepper walker = make_by(saver, id);
        walker.environment->set_world(world);
        return walker;
      },
      [&id = id, &loader] { return make_by(loader, id); },
      [&kind = kind, num_joints](int seed) { return Actions(kind, seed, num_joints); }, 5, 60);
}

std::string name_of(const testing::TestParamInfo<SavedStateTest::ParamType>& info) {
  const auto& [id, saver, kind] = info.param;
  return test_name(id) + (saver == nullptr ? "_kernel_to_off_" : "_off_to_kernel_") + kind;
}

INSTANTIATE_TEST_SUITE_P(
    Walkers, SavedStateTest,
    testing::Combine(testing::Values("Walker2d-v4", "Walker2d-v5", "Hopper-v4", "Hopper-v5"),
                     testing::Values(nullptr, "off"), testing::Values("random", "balance")),
    name_of);

TEST(SavedState, RejectsAChangedModel) {
  const Folder folder;
  const std::string text = builtin_text("walker2d_v5.xml");
  const Parameters parameters{{"xml_file", folder.write("walker.xml", text)}};
  Stepper walker("Walker2d-v5", parameters);
  walker.reset(1);
  Stepper alike("Walker2d-v5", parameters);
  load(alike, save(walker));
  folder.write("walker.xml", replaced(text, "gear=\"100\"", "gear=\"90\""));
  Stepper changed("Walker2d-v5", parameters);
  EXPECT_EQ(refusal(changed, save(walker)),
            "the state is of another model than this Walker2d-v5; has a file changed that its "
            "parameters name?");
}

TEST(SavedState, AfterAnUnstableSimulation) {
  const Folder folder;
  const std::string model = folder.write(
      "strong.xml", replaced(builtin_text("walker2d_v5.xml"), "gear=\"100\"", "gear=\"1e14\""));
  const Parameters parameters{{"xml_file", model}};
  Stepper walker("Walker2d-v5", parameters);
  walker.reset(1);
  const State state = save(walker);
  walker.step(std::vector<double>(6, 1));
  ASSERT_STRNE(walker.result.error, "");
  Stepper fresh("Walker2d-v5", parameters);
  load(fresh, save(walker));
  EXPECT_STREQ(fresh.result.error, walker.result.error);
  EXPECT_STREQ(fresh.result.end_reason, "the simulation failed");
  EXPECT_THROW(fresh.step(std::vector<double>(6)), ResetNeeded);
  load(walker, state);  // clears MuJoCo's warnings
  load(fresh, state);
  expect_alike_from_here(walker, fresh, Actions("zero", 1));
}

TEST(SavedState, RejectsStatesOfOtherEnvironments) {
  Stepper walker("Walker2d-v5");
  walker.reset(1);
  const State before = save(walker);
  EXPECT_EQ(refusal(walker, save(Stepper("Walker2d-v4"))),
            "the state is of another environment: id = Walker2d-v4 there; here it is Walker2d-v5");
  EXPECT_EQ(refusal(walker, save(Stepper("Walker2d-v5", {{"healthy_reward", 0.5}}))),
            "the state is of another environment: parameter healthy_reward = 0.5 there; here it "
            "is 1.0");
  EXPECT_EQ(save(walker), before) << "what is refused changes nothing";
}

TEST(SavedState, NumbersMustBeFinite) {
  for (const char* world : {"gymnasium", "laggy", "walker2d_stumps"}) {
    SCOPED_TRACE(world);
    Stepper walker("Walker2d-v5");
    walker.environment->set_world(load_world(world));
    walker.reset(3);
    for (int i = 0; i < 5; ++i) walker.step(std::vector<double>(6, 0.1));
    expect_finite_numbers(walker, 1);
  }
}

TEST(SavedState, DoesNotDependOnTheLocale) {
  const std::string id = "Walker2d-v5";
  const Parameters parameters{{"reset_noise_scale", 1e-3}};
  const std::vector<double> action{0.5, -0.25, 0.125, 0.5, -0.25, 0.125};
  Stepper before(id, parameters);
  before.reset(7);
  before.step(action);
  const State state = save(before);
  before.step(action);
  const ForeignLocale locale;
  Stepper after(id, parameters);
  load(after, state);
  EXPECT_EQ(save(after), state);
  after.step(action);
  expect_alike(after, before);
}

}  // namespace
}  // namespace walker::mujoco
