// The first seed, the end of episodes, allocations, and exceptions from Box2D.
#include "robots/bipedal_walker/bipedal_walker.h"

#include <gtest/gtest.h>

#include <array>
#include <stdexcept>
#include <vector>

#include "allocation_counter.h"
#include "episode/walker.h"
#include "robots/bipedal_walker/player.h"

namespace walker::bipedal_walker {
namespace {

TEST(Episodes, FirstResetWithoutASeedDrawsOne) {
  Stepper walker(kPlain);
  Stepper other(kPlain);
  walker.reset();
  other.reset();
  EXPECT_NE(walker.environment->generator_state(), GeneratorState{});
  EXPECT_NE(walker.environment->generator_state(), other.environment->generator_state());
}

TEST(Episodes, ResetReportsNoRewardAndNoEnd) {
  Stepper walker(kPlain);
  play(walker, 1, Actions("zero", 0));
  ASSERT_TRUE(walker.result.terminated);
  EXPECT_EQ(walker.result.reward, -100);
  EXPECT_STREQ(walker.result.end_reason, "hull touched the ground");
  walker.reset();
  EXPECT_FALSE(walker.has_ended());
  EXPECT_EQ(walker.result.reward, 0);
  EXPECT_STREQ(walker.result.end_reason, "");
  EXPECT_STREQ(walker.result.error, "");
}

/// Stepping, sensing and acting allocate nothing by operator new; Box2D allocates by malloc.
TEST_F(AllocationTest, StepsSensesAndActsWithoutTheHeap) {
  for (const char* id : {kPlain, kHardcore}) {
    Stepper walker(id);
    Sensors sensors;
    int steps = 0;
    for (std::uint64_t seed = 0; steps < 1000; ++seed) {
      walker.reset(seed);
      walker.environment->sense(sensors);  // sizes the vectors
      Heuristic heuristic;
      std::array<double, kJointCount> action{};
      const Counting counting;
      for (; !walker.has_ended(); ++steps) {
        heuristic.act(walker.observation.data(), action.data());
        walker.environment->step(action.data(), action.size(), walker.result);
        walker.environment->sense(sensors);
      }
    }
    EXPECT_EQ(allocations, 0) << id << " in " << steps << " steps";
  }
}

}  // namespace

/// Throws from within b2World::Step when two bodies come close, as a failed assertion does.
class FailingFilter : public b2ContactFilter {
 public:
  bool ShouldCollide(b2Fixture* /*one*/, b2Fixture* /*other*/) override {
    throw std::logic_error("an assertion");
  }
};

class BrokenWorldTest : public testing::Test {
 protected:
  void make(bool reuse_world) {
    auto walker = std::make_unique<BipedalWalker>(
        kPlain,
        complete_parameters(parameter_descriptions(kPlain), {{"reuse_world", reuse_world}}));
    robot_ = walker.get();
    walker_ = std::make_unique<Walker>(std::move(walker));
    result_.observation = observation_.data();
  }

  void break_world() { const_cast<b2World&>(robot_->physics_->world()).SetContactFilter(&filter_); }

  void step_until_the_end() {
    const std::array<double, kJointCount> action{};
    for (int i = 0; i < 500 && !result_.terminated; ++i) {
      walker_->step(action.data(), action.size(), result_);
    }
  }

  std::array<double, kObservationSize> observation_{};
  Result result_;
  FailingFilter filter_;
  std::unique_ptr<Walker> walker_;
  BipedalWalker* robot_ = nullptr;
};

TEST_F(BrokenWorldTest, EndsTheEpisodeAndIsRepairedByTheNextReset) {
  for (const bool reuse_world : {false, true}) {
    make(reuse_world);
    walker_->reset(1, result_);
    const auto start = observation_;
    break_world();
    step_until_the_end();
    EXPECT_TRUE(result_.terminated);
    EXPECT_STREQ(result_.error, "Box2D failed an assertion");
    walker_->reset(1, result_);
    EXPECT_EQ(observation_, start);
    EXPECT_STREQ(result_.error, "");
    EXPECT_FALSE(result_.terminated);
    step_until_the_end();
    EXPECT_STREQ(result_.end_reason, "hull touched the ground");
  }
}

TEST_F(BrokenWorldTest, ResetCanFail) {
  make(true);
  walker_->reset(1, result_);
  break_world();  // destroy() keeps the b2World, and so the filter
  EXPECT_THROW(walker_->reset(2, result_), std::runtime_error);
  EXPECT_THROW(step_until_the_end(), ResetNeeded);
  EXPECT_NO_THROW(walker_->reset(2, result_));
}

TEST_F(BrokenWorldTest, DisturbsNoOtherOfItsGroup) {
  constexpr std::size_t kWalkers = 5;
  constexpr std::size_t kBroken = 3;
  std::array<std::array<std::unique_ptr<Walker>, kWalkers>, 2> sides;
  auto& [group, single] = sides;
  for (auto& side : sides) {
    for (std::size_t i = 0; i < kWalkers; ++i) {
      make(false);
      walker_->reset(i == kBroken ? 1 : 10 + i, result_);
      if (i == kBroken) break_world();
      side[i] = std::move(walker_);
    }
  }
  const std::array<double, kJointCount> action{};
  bool has_failed = false;
  for (int step = 0; step < 200; ++step) {
    std::vector<Walker::GroupStep> steps;
    for (std::size_t i = 0; i < kWalkers; ++i) {
      for (auto& side : sides) {
        if (side[i]->state().terminated) side[i]->reset(step, result_);
      }
      steps.push_back({group[i].get(), action.data()});
      single[i]->step(action.data(), action.size(), result_);
    }
    Walker::step_group(steps.data(), kWalkers);
    for (std::size_t i = 0; i < kWalkers; ++i) {
      const EpisodeState& ours = group[i]->state();
      const EpisodeState& theirs = single[i]->state();
      EXPECT_EQ(ours.observation, theirs.observation) << i << " in step " << step;
      EXPECT_EQ(ours.reward, theirs.reward);
      ASSERT_EQ(ours.terminated, theirs.terminated);
      EXPECT_EQ(ours.error, theirs.error);
      has_failed = has_failed || !ours.error.empty();
    }
  }
  EXPECT_TRUE(has_failed);
}

}  // namespace walker::bipedal_walker
