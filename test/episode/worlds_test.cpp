// Episodes in worlds have the same bits however they are played: alone, in a pool beside other
// worlds, with any number of threads, from a saved state, from a record, or by the drawn numbers.
#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "bits.h"
#include "episode/episode.h"
#include "episode/rollout.h"
#include "error_message.h"
#include "test_name.h"

namespace walker {
namespace {

using Bits = std::vector<std::vector<std::uint64_t>>;

struct Case {
  std::string id;
  Parameters parameters = {};
};

class WorldsTest : public testing::TestWithParam<Case> {
 protected:
  static constexpr int kSteps = 120;

  static std::unique_ptr<Episode> make_walker() {
    return make_episode(GetParam().id, GetParam().parameters);
  }

  WorldsTest() {
    World all{{"gravity", {-11, -7}},
              {"friction_scale", {0.5, 1.5}},
              {"motor_strength", {0.8, 1.2}},
              {"mass_scale", {0.8, 1.25}},
              {"joint_damping", {0, 0.05}},
              {"push_interval", {0.1, 0.3}},
              {"action_delay", {0, 0.05}},
              {"action_noise", {0, 0.1}},
              {"observation_delay", {0, 0.05}},
              {"dropout", {0, 0.2}},
              {"joint_position_noise", {0, 0.1}},
              {"joint_velocity_noise", {0, 0.1}},
              {"orientation_noise", {0, 0.1}},
              {"angular_velocity_noise", {0, 0.1}},
              {"linear_velocity_noise", {0, 0.1}},
              {"lidar_range", {2, 6}},
              {"range_noise", {0, 0.1}}};
    World level = load_world("hard");
    level["hip_speed"] = {3, 5};
    level["knee_speed"] = {5, 7};
    level["initial_push"] = {0, 1};
    if (GetParam().id.rfind("Bipedal", 0) == 0) {
      all.insert(level.begin(), level.end());
      worlds_.push_back(level);
    } else {
      worlds_.push_back({{"ground_roughness", {0, 2}},
                         {"pit_gap", {0.1, 0.5}},
                         {"stump_height", {0.05, 0.3}},
                         {"stair_height", {0.02, 0.2}},
                         {"stair_steps", {1, 4}},
                         {"obstacle_spacing", {0.2, 2}},
                         {"gravity", {-11, -8}}});
      worlds_.push_back(load_world("walker2d_rough"));
    }
    worlds_.insert(worlds_.end(),
                   {all, World{}, load_world("pushed"), load_world("laggy"), load_world("noisy"),
                    load_world("slippery"), load_world("moon")});
  }

  /// Observations, rewards and flags of an episode, which is reset when it ends.
  Bits play(Episode& episode, std::uint64_t seed) {
    episode.reset(seed);
    Bits bits{row_of(episode)};
    continue_episode(episode, kSteps, seed, bits);
    return bits;
  }

  void continue_episode(Episode& episode, int steps, std::uint64_t seed, Bits& bits) {
    std::mt19937 random(static_cast<unsigned>(seed + bits.size()));
    std::uniform_real_distribution<double> unit(-1, 1);
    std::vector<double> action(episode.specification().action_size());
    for (int i = 0; i < steps; ++i) {
      for (double& value : action) value = unit(random);
      if (episode.state().has_ended()) {
        episode.reset(std::nullopt);
      } else {
        episode.step(action);
      }
      bits.push_back(row_of(episode));
    }
  }

  static std::vector<std::uint64_t> row_of(const Episode& episode) {
    std::vector<double> row = episode.state().observation;
    row.push_back(episode.state().reward);
    row.push_back(episode.state().terminated ? 1 : 0);
    return to_bits(row);
  }

  std::vector<World> worlds_;
};

TEST_P(WorldsTest, PoolsHaveTheBitsOfSingleEpisodes) {
  const std::size_t count = 3 * worlds_.size();
  for (const std::size_t threads : {1U, 3U}) {
    Rollout rollout(GetParam().id, {count, threads, AutoresetMode::next_step, 0},
                    GetParam().parameters);
    std::vector<World> worlds;
    for (std::size_t i = 0; i < count; ++i) worlds.push_back(worlds_[i % worlds_.size()]);
    rollout.pool.set_world({}, worlds);
    rollout.reset(0);
    std::vector<std::unique_ptr<Episode>> singles;
    for (std::size_t i = 0; i < count; ++i) {
      singles.push_back(make_walker());
      singles.back()->set_world(worlds[i]);
      singles.back()->reset(i);
    }
    std::mt19937 random(1);
    for (int step = 0; step < kSteps; ++step) {
      std::mt19937 same = random;
      const std::vector<double> actions = rollout.draw_actions(same, count);
      rollout.step(random);
      for (std::size_t i = 0; i < count; ++i) {
        Episode& single = *singles[i];
        if (single.state().has_ended()) {
          single.reset(std::nullopt);
        } else {
          single.step(&actions[i * single.specification().action_size()],
                      single.specification().action_size());
        }
        ASSERT_EQ(row_of(single), row_of(rollout.pool.episode(i)))
            << "environment " << i << ", step " << step << ", " << to_string(worlds[i]);
        ASSERT_EQ(single.world_values(), rollout.pool.episode(i).world_values());
      }
    }
  }
}

TEST_P(WorldsTest, ContinuesSavedStates) {
  for (const World& world : worlds_) {
    const auto original = make_walker();
    original->set_world(world);
    Bits bits = play(*original, 11);
    std::vector<std::byte> state;
    original->save_state(state);
    const auto other = make_walker();
    other->set_world(worlds_[0]);
    other->reset(3);
    other->load_state(state.data(), state.size());
    EXPECT_EQ(other->world(), world);
    EXPECT_EQ(other->world_values(), original->world_values());
    std::vector<std::byte> again;
    other->save_state(again);
    EXPECT_EQ(again, state);
    Bits same = bits;
    continue_episode(*original, kSteps, 11, bits);
    continue_episode(*other, kSteps, 11, same);
    EXPECT_EQ(same, bits) << to_string(world);
  }
}

TEST_P(WorldsTest, RepeatsRecordsAndDrawnNumbers) {
  for (const World& world : worlds_) {
    const auto original = make_walker();
    original->configure({std::nullopt, true});
    original->set_world(world);
    original->reset(4);
    std::vector<double> action(original->specification().action_size(), 0.3);
    Bits bits{row_of(*original)};
    const auto by_numbers = make_walker();
    by_numbers->set_world(as_numbers(original->world_values()));
    by_numbers->reset(4);
    Bits numbers{row_of(*by_numbers)};
    for (int i = 0; i < 40 && !original->state().has_ended(); ++i) {
      action[i % action.size()] *= -1;
      original->step(action);
      by_numbers->step(action);
      bits.push_back(row_of(*original));
      numbers.push_back(row_of(*by_numbers));
    }
    EXPECT_EQ(numbers, bits) << to_string(world);
    const EpisodeRecord record = original->record();
    EXPECT_EQ(record.world, original->world_values());
    const auto repeated = make_walker();
    repeated->configure({std::nullopt, true});
    repeated->set_world(load_world("moon"));  // the record's world holds
    repeated->begin(record);
    EXPECT_TRUE(repeated->repeat(record, std::chrono::steady_clock::time_point::max()));
    EXPECT_EQ(row_of(*repeated), bits.back()) << to_string(world);
    EXPECT_EQ(repeated->world(), load_world("moon"));
  }
}

TEST_P(WorldsTest, TakesEffectAtTheNextReset) {
  const auto plain = make_walker();
  const Bits bits = play(*plain, 2);
  const auto episode = make_walker();
  episode->reset(2);
  episode->set_world(worlds_[0]);
  Bits same{row_of(*episode)};
  EXPECT_EQ(episode->world_values(), WorldValues{});
  const std::vector<double> action(episode->specification().action_size());
  const auto other = make_walker();
  other->reset(2);
  episode->step(action);
  other->step(action);
  EXPECT_EQ(row_of(*episode), row_of(*other));
  episode->reset(7);
  EXPECT_EQ(episode->world_values().size(), worlds_[0].size());
  episode->set_world(World{});
  EXPECT_EQ(play(*episode, 2), bits);  // nothing of the world is left
}

TEST_P(WorldsTest, RefusesAnythingThatCannotBeApplied) {
  Pool pool([] { return make(GetParam().id); }, {3, 1, AutoresetMode::next_step, 0});
  pool.set_world({}, {load_world("moon")});
  const World unknown{{"wind", {1, 1}}};
  EXPECT_NE(message_of<std::invalid_argument>([&] {
              pool.set_world({}, {World{}, World{}, unknown});
            }).find("world parameter wind = 1.0: unknown"),
            std::string::npos);
  EXPECT_EQ(message_of<std::invalid_argument>([&] {
              pool.set_world({}, {World{}, World{}});
            }),
            "2 worlds; must be 1, or 3 as the environments");
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(pool.environment(i).world(), load_world("moon"));
  pool.set_world({1}, {World{}});
  EXPECT_EQ(pool.environment(1).world(), World{});
  EXPECT_EQ(pool.environment(2).world(), load_world("moon"));
}

TEST(WorldsTest, ObserveFromTheStateThatIsSet) {
  const auto episode = make_episode("Walker2d-v5");
  episode->set_world(World{{"observation_delay", {0.024, 0.024}}});
  episode->reset(1);
  const std::vector<double> action(6, 0.1);
  for (int i = 0; i < 5; ++i) episode->step(action);
  std::vector<double> position(9, 0);
  position[1] = 1.5;
  episode->set_coordinates(position, std::vector<double>(9, 0));
  const std::vector<double> first = episode->state().observation;
  EXPECT_EQ(first[0], 1.5);
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(episode->state().observation, first) << i;
    episode->step(action);
  }
  EXPECT_EQ(episode->state().observation, first);
  episode->step(action);
  EXPECT_NE(episode->state().observation, first);
}

INSTANTIATE_TEST_SUITE_P(
    Ids, WorldsTest,
    testing::Values(Case{"BipedalWalker-v3"}, Case{"BipedalWalkerHardcore-v3"}, Case{"Walker2d-v4"},
                    Case{"Walker2d-v5", {{"include_lidar_in_observation", true}}},
                    Case{"Walker2d-v5"},
                    Case{"Hopper-v5", {{"include_lidar_in_observation", true}}}),
    [](const auto& one) {
      return test_name(one.param.id) + (one.param.parameters.empty() ? "" : "_with_lidar");
    });

}  // namespace
}  // namespace walker
