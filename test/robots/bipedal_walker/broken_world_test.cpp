// What happens when the engine fails in the middle of a step.
#include <gtest/gtest.h>

#include <stdexcept>
#include <vector>

#include "robots/bipedal_walker/bipedal_walker.h"
#include "episode/episode_rules.h"

namespace walker::bipedal_walker {

/// Throws from within b2World::Step when two bodies come near each other, as a failed assertion.
class FailingFilter : public b2ContactFilter {
 public:
  bool ShouldCollide(b2Fixture* /*one*/, b2Fixture* /*other*/) override {
    throw std::logic_error("an assertion");
  }
};

class BrokenWorldTest : public testing::Test {
 protected:
  void make(bool reuse_world) {
    Options options;
    options.id = "BipedalWalker-v3";
    options.reuse_world = reuse_world;
    auto walker = std::make_unique<BipedalWalker>(options);
    walker_ = walker.get();
    rules_ = std::make_unique<EpisodeRules>(std::move(walker));
    result_.observation = observation_.data();
  }

  void break_world() {
    const_cast<b2World&>(walker_->physics_->world()).SetContactFilter(&filter_);
  }

  void walk_until_the_end() {
    const std::array<double, kJointCount> action{};  // it falls
    for (int i = 0; i < 500 && !result_.terminated; ++i) {
      rules_->step(action.data(), action.size(), result_);
    }
  }

  std::array<double, kObservationSize> observation_{};
  Result result_;
  FailingFilter filter_;
  std::unique_ptr<EpisodeRules> rules_;
  BipedalWalker* walker_ = nullptr;
};

TEST_F(BrokenWorldTest, EndsTheEpisodeAndSaysWhy) {
  make(false);
  rules_->reset(1, result_);
  break_world();
  walk_until_the_end();
  EXPECT_TRUE(result_.terminated);
  EXPECT_STREQ(result_.end_reason, "the simulation failed");
  EXPECT_STREQ(result_.error, "Box2D failed an assertion");
  EXPECT_EQ(result_.reward, 0);
  Sensors sensors;
  EXPECT_THROW(rules_->sense(sensors), ResetNeeded);
}

TEST_F(BrokenWorldTest, TheNextResetRepairsIt) {
  for (const bool reuse_world : {false, true}) {
    make(reuse_world);
    rules_->reset(1, result_);
    const auto start = observation_;
    break_world();
    walk_until_the_end();
    ASSERT_STRNE(result_.error, "");
    rules_->reset(1, result_);
    EXPECT_EQ(observation_, start);
    EXPECT_STREQ(result_.error, "");
    EXPECT_FALSE(result_.terminated);
    walk_until_the_end();
    EXPECT_STREQ(result_.end_reason, "hull touched the ground");
  }
}

TEST_F(BrokenWorldTest, AResetThatFailsSaysSo) {
  make(true);
  rules_->reset(1, result_);
  break_world();  // the filter stays with the world that is used again
  EXPECT_THROW(rules_->reset(2, result_), std::runtime_error);
  EXPECT_THROW(walk_until_the_end(), ResetNeeded);
  EXPECT_NO_THROW(rules_->reset(2, result_));
}

/// Of several that are stepped together.
TEST_F(BrokenWorldTest, DisturbsNoOther) {
  constexpr std::size_t kWalkers = 5;
  constexpr std::size_t kBroken = 3;
  struct Episode {
    std::unique_ptr<EpisodeRules> rules;
    std::array<double, kObservationSize> observation{};
    Result result;
  };
  const auto begin = [this] {
    auto episodes = std::make_unique<std::array<Episode, kWalkers>>();
    for (std::size_t i = 0; i < kWalkers; ++i) {
      Episode& episode = (*episodes)[i];
      make(false);
      episode.rules = std::move(rules_);
      episode.result.observation = episode.observation.data();
      episode.rules->reset(i == kBroken ? 1 : 10 + i, episode.result);
      if (i == kBroken) break_world();
    }
    return episodes;
  };
  const auto together = begin();
  const auto apart = begin();
  const std::array<double, kJointCount> action{};
  bool has_failed = false;
  for (int step = 0; step < 200; ++step) {
    std::vector<StepCall> calls;
    calls.reserve(kWalkers);
    for (std::size_t i = 0; i < kWalkers; ++i) {
      Episode& one = (*together)[i];
      Episode& other = (*apart)[i];
      ASSERT_EQ(one.result.terminated, other.result.terminated) << i;
      if (one.result.terminated) {
        ASSERT_STREQ(one.result.error, other.result.error) << i;
        has_failed = has_failed || one.result.error[0] != '\0';
        one.rules->reset(step, one.result);
        other.rules->reset(step, other.result);
      }
      calls.push_back({one.rules.get(), action.data(), &one.result, nullptr});
      other.rules->step(action.data(), action.size(), other.result);
    }
    std::vector<StepCall*> pointers;
    pointers.reserve(kWalkers);
    for (StepCall& call : calls) pointers.push_back(&call);
    (*together)[0].rules->step_together(pointers.data(), kWalkers, action.size());
    for (std::size_t i = 0; i < kWalkers; ++i) {
      EXPECT_FALSE(calls[i].failure) << "the rules tell it";
      EXPECT_EQ((*together)[i].observation, (*apart)[i].observation) << i << " in step " << step;
      EXPECT_EQ((*together)[i].result.reward, (*apart)[i].result.reward);
    }
  }
  EXPECT_TRUE(has_failed);
}

}  // namespace walker::bipedal_walker
