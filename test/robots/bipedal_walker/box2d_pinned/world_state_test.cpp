// A world that loads another world's state has all of its state and the same future.
#include <gtest/gtest.h>

#include <random>
#include <string>
#include <tuple>

#include "robots/bipedal_walker/twin.h"

namespace walker::bipedal_walker {
namespace {

class World : public Twin {
 public:
  using Twin::Twin;

  std::vector<std::byte> save() {
    std::vector<std::byte> state;
    StateWriter writer(state);
    physics_->save(writer);
    return state;
  }

  void load(World& other) {
    const std::vector<std::byte> state = other.save();
    StateReader reader(state.data(), state.size());
    const auto restore = Physics::read_state(reader, other.ground_);
    reader.finish();
    if (other.ground_.points[50].y != ground_.points[50].y) {
      ground_ = other.ground_;
      physics_.emplace();
      physics_->build(ground_, 0);
    }
    restore(*physics_);
    generator_ = other.generator_;
  }

  std::vector<std::uint32_t> words() { return words_of(*physics_); }
};

/// Mode, hardcore, reuse_world.
class WorldStateTest : public testing::TestWithParam<std::tuple<std::string, bool, bool>> {
 protected:
  using Action = std::array<double, kJointCount>;

  Action draw() {
    Action action{};
    if (std::get<0>(GetParam()) == "rest") return action;
    for (double& value : action) value = std::uniform_real_distribution<double>(-1, 1)(random_);
    return action;
  }

  void expect_same_future(World& actual, World& expected, int num_steps) {
    ASSERT_EQ(actual.words(), expected.words()) << "at once";
    ASSERT_EQ(actual.save(), expected.save());
    for (int reset = 0; reset < 3; ++reset) {
      for (int i = 0; i < num_steps; ++i) {
        const Action action = draw();
        actual.step(action.data());
        expected.step(action.data());
        ASSERT_EQ(actual.words(), expected.words()) << reset << " resets, " << i + 1 << " steps";
      }
      ASSERT_EQ(actual.save(), expected.save());
      actual.reset();
      expected.reset();
      ASSERT_EQ(actual.words(), expected.words()) << "after " << reset + 1 << " resets";
    }
  }

  std::mt19937 random_{7};
};

TEST_P(WorldStateTest, HasTheSameFuture) {
  const auto& [mode, hardcore, reuse_world] = GetParam();
  World original(1, hardcore, reuse_world);
  World another(2, hardcore, reuse_world);  // loads every state, whatever its own history
  int num_asleep = 0;
  for (int time = 0; time < 12; ++time) {
    if (mode == "rest") original.reset();  // some walkers fall asleep, others never do
    const auto num_steps = mode == "rest" ? 300 : random_() % 60;
    for (std::size_t i = 0; i < num_steps && original.physics().hull().IsAwake(); ++i) {
      original.step(draw().data());
    }
    for (int i = 0; i < time; ++i) another.step(draw().data());
    num_asleep += original.physics().hull().IsAwake() ? 0 : 1;
    const std::vector<std::uint32_t> before = original.words();
    World fresh(3, hardcore, reuse_world);
    fresh.load(original);
    another.load(original);
    ASSERT_EQ(original.words(), before) << "saving changes nothing";
    ASSERT_EQ(another.words(), before);
    ASSERT_NO_FATAL_FAILURE(expect_same_future(fresh, another, 25)) << "time " << time;
    another.load(original);
    ASSERT_EQ(another.words(), before);
    if (time % 4 == 3 && mode != "rest") {
      original.reset();
      another.reset();
      ASSERT_EQ(another.words(), original.words());
    }
  }
  if (mode == "rest") {
    EXPECT_GT(num_asleep, 0);
  }
}

INSTANTIATE_TEST_SUITE_P(Worlds, WorldStateTest,
                         testing::Combine(testing::Values("random", "rest"), testing::Bool(),
                                          testing::Bool()));

}  // namespace
}  // namespace walker::bipedal_walker
