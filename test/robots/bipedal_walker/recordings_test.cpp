// Terrains and episodes recorded from Gymnasium 1.4.0, reproduced bit by bit.
#include <gtest/gtest.h>

#include <memory>
#include <set>

#include "recording.h"
#include "robots/bipedal_walker/ground_numbers.h"
#include "robots/bipedal_walker/player.h"

namespace walker::bipedal_walker {
namespace {

/// Calls play(walker, episode) for each episode of a recording, whose sessions reset one
/// environment several times.
template <typename Play>
void for_each_episode(Recording& recording, const Play& play) {
  std::unique_ptr<Stepper> walker;
  while (recording.has_more()) {
    if (recording.next<std::string>() == "session") {
      const auto id = recording.next<std::string>();
      walker = std::make_unique<Stepper>(id, Parameters{{"reuse_world", recording.next<bool>()}});
      continue;
    }
    const Headline episode(recording);
    SCOPED_TRACE(walker->environment->specification().id + " " + episode.kind + " seed " +
                 episode.seed);
    ASSERT_NO_FATAL_FAILURE(play(*walker, episode));
  }
}

/// Compares every observation, reward and flag.
TEST(Recordings, EveryStepHasGymnasiumsHash) {
  Recording recording("episodes.txt");
  std::size_t episodes = 0;
  std::set<std::string> kinds;
  for_each_episode(recording, [&](Stepper& walker, const Headline& episode) {
    auto rows = play(walker, episode.reset_seed(), Actions(episode.kind, episode.action_seed));
    ASSERT_EQ(rows.size(), episode.steps + 1);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      // With float64 actions, Gymnasium rounds rewards differently, so they are not compared.
      if (episode.kind == "double") rows[i][kObservationSize] = 0;
      ASSERT_EQ(short_hash(rows[i]), recording.next_hexadecimal())
          << "step " << i << " of episode " << episodes;
    }
    kinds.insert(episode.kind);
    ++episodes;
  });
  EXPECT_GE(episodes, 300U);
  EXPECT_EQ(kinds.size(), 7U);
}

/// Compares the values instead of hashes, so that failures show the difference.
TEST(Recordings, FullEpisodesAreEqual) {
  Recording recording("full_episodes.txt");
  std::size_t steps = 0;
  for_each_episode(recording, [&](Stepper& walker, const Headline& episode) {
    replay<Actions>(episode, walker, [&](std::size_t i, const std::vector<double>& action) {
      for (const double value : action) ASSERT_EQ(to_bits(value), to_bits(recording.next_float()));
      const std::vector<double> row = walker.row();
      for (std::size_t k = 0; k < row.size(); ++k) {
        const double expected =
            k <= kObservationSize ? recording.next_float() : recording.next<double>();
        ASSERT_EQ(to_bits(row[k]), to_bits(expected))
            << "step " << i << ", number " << k << ": " << row[k] << " instead of " << expected;
      }
    });
    ASSERT_TRUE(walker.has_ended());
    steps += episode.steps;
  });
  EXPECT_GT(steps, 2500U);
}

TEST(Recordings, TerrainsHaveGymnasiumsDoubles) {
  Recording recording("terrains.txt");
  int compared[2] = {0, 0};
  while (recording.has_more()) {
    const bool hardcore = recording.next<bool>();
    const auto seed = recording.next<std::uint64_t>();
    Hash hash;
    for (const double number : ground_numbers(hardcore, seed)) hash.add(number);
    ASSERT_EQ(hash.value(), recording.next_hexadecimal())
        << "hardcore " << hardcore << ", seed " << seed;
    ++compared[hardcore ? 1 : 0];
  }
  EXPECT_GE(compared[0], 1000);
  EXPECT_GE(compared[1], 1000);
}

}  // namespace
}  // namespace walker::bipedal_walker
