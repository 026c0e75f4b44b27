// Saved states of BipedalWalker: worlds that are reused, sensors, progress, and refusals.
#include <gtest/gtest.h>

#include <random>
#include <tuple>

#include "episode/saved_state.h"
#include "robots/bipedal_walker/player.h"
#include "saved_states.h"

namespace walker::bipedal_walker {
namespace {

/// Id and the kind of actions, two of which are in worlds that the loaders do not have.
class SavedStateTest : public testing::TestWithParam<std::tuple<std::string, std::string>> {};

TEST_P(SavedStateTest, HasTheSameFutureInAReusedWorld) {
  const auto& [id, kind] = GetParam();
  const Parameters parameters{{"reuse_world", true}};
  const auto make = [&id = id, &parameters] { return Stepper(id, parameters); };
  World world;
  if (kind == "noisy" || kind == "saturated") {
    world = {
        {"gravity", {-12, -8}},      {"mass_scale", {0.8, 1.5}}, {"hull_mass", {4, 7}},
        {"floor_friction", {1, 3}},  {"lidar_range", {2, 8}},    {"friction_scale", {0.3, 2}},
        {"joint_damping", {0, 0.1}}, {"hip_speed", {3, 5}},      {"motor_strength", {0.8, 1.2}}};
  }
  const auto make_in_world = [&] {
    Stepper walker = make();
    walker.environment->set_world(world);
    return walker;
  };
  expect_same_future(
      make_in_world, make, [&kind = kind](int seed) { return Actions(kind, seed); }, 8, 150);
}

INSTANTIATE_TEST_SUITE_P(Walkers, SavedStateTest,
                         testing::Combine(testing::Values(kPlain, kHardcore),
                                          testing::Values("random", "heuristic", "noisy",
                                                          "saturated")));

Stepper walked(const std::string& id = kPlain, const Parameters& parameters = {},
               int num_steps = 30) {
  Stepper walker(id, parameters);
  walker.reset(4);
  for (int i = 0; i < num_steps; ++i) walker.step({0.3, -0.4, 0.5, 0.6});
  return walker;
}

TEST(SavedState, HasTheProgressOfTheEpisode) {
  Stepper walker(kPlain);
  walker.reset(4);
  double episode_return = 0;
  for (int i = 0; i < 30; ++i) {
    walker.step({0.3, -0.4, 0.5, 0.6});
    episode_return += walker.result.reward;
  }
  Stepper fresh(kPlain);
  const Progress progress = load(fresh, save(walker));
  EXPECT_TRUE(progress.has_begun);
  EXPECT_EQ(progress.steps, 30U);
  EXPECT_EQ(progress.episode_return, episode_return);
  EXPECT_FALSE(load(walker, save(Stepper(kPlain))).has_begun);
  EXPECT_THROW(walker.step({0, 0, 0, 0}), ResetNeeded);
  EXPECT_EQ(walker.environment->generator_state(), GeneratorState{});
}

TEST(SavedState, AfterTheEnd) {
  Stepper walker(kPlain);
  walker.reset(4);
  while (!walker.has_ended()) walker.step({1, 1, 1, 1});
  Stepper fresh(kPlain);
  load(fresh, save(walker));
  expect_alike(fresh, walker);
  EXPECT_THROW(fresh.step({0, 0, 0, 0}), ResetNeeded);
  EXPECT_STREQ(fresh.result.end_reason, "hull touched the ground");
}

TEST(SavedState, TimeLimitIsTheLoaders) {
  Stepper limited(kPlain, {{"max_episode_steps", std::int64_t{32}}});
  load(limited, save(walked()));
  limited.step({0, 0, 0, 0});
  EXPECT_FALSE(limited.has_ended());
  limited.step({0, 0, 0, 0});
  EXPECT_TRUE(limited.result.truncated);
  EXPECT_STREQ(limited.result.end_reason, "32 steps");
}

TEST(SavedState, DamagedOneIsRejected) {
  Stepper walker = walked();
  const State before = save(walker);
  const State state = save(walked(kPlain, {}, 40));
  for (std::size_t size = 0; size < state.size(); size += size < 800 ? 1 : 97) {
    EXPECT_NE(refusal(walker, State(state.begin(), state.begin() + size)), kNothing)
        << size << " bytes";
  }
  for (std::size_t i = 0; i < state.size(); i += i < 800 ? 1 : 13) {
    for (const unsigned bit : {1U, 128U}) {
      State flipped = state;
      flipped[i] ^= std::byte(bit);
      EXPECT_NE(refusal(walker, flipped), kNothing) << "byte " << i;
    }
  }
  State longer = state;
  longer.push_back({});
  EXPECT_NE(refusal(walker, longer), kNothing);
  EXPECT_EQ(refusal(walker, State(7)),
            "these 7 bytes are no saved state; one begins with WALKERST");
  EXPECT_NE(refusal(walker, State(state.begin(), state.end() - 1)).find("must have"),
            std::string::npos);
  EXPECT_EQ(save(walker), before) << "what is refused changes nothing";
}

TEST(SavedState, NumbersMustBeFinite) {
  Stepper walker = walked();
  expect_finite_numbers(walker, 7);
}

/// With a valid checksum, corrupt data may change numbers but must not cause invalid accesses.
TEST(SavedState, IndicesAreChecked) {
  const State state = save(walked(kHardcore, {}, 40));
  Stepper walker(kHardcore);
  std::mt19937 random(5);
  int num_rejected = 0;
  int num_loaded = 0;
  for (int i = 0; i < 1500; ++i) {
    State changed = state;
    const std::size_t at = 28 + random() % (state.size() - 28 - 4);
    std::uint32_t word = ~0U;
    if (i % 3 != 2) word = static_cast<std::uint32_t>(random());
    if (i % 3 == 1) word %= 600;
    std::memcpy(&changed[at - at % 4], &word, sizeof word);
    StateOrigin::seal(changed, 0);
    const State before = save(walker);
    if (refusal(walker, changed) != kNothing) {
      ++num_rejected;
      ASSERT_EQ(save(walker), before);
      continue;
    }
    ++num_loaded;
    for (int step = 0; step < 3 && !walker.has_ended(); ++step) {
      try {
        walker.step({0.5, -0.5, 1, -1});
      } catch (const ResetNeeded&) {
        break;
      }
    }
    if (num_loaded % 8 == 0) walker.reset(2);
  }
  EXPECT_GT(num_rejected, 300);
  EXPECT_GT(num_loaded, 300);
}

}  // namespace
}  // namespace walker::bipedal_walker
