// Episodes recorded from Gymnasium 1.4.0, reproduced bit by bit.
#include <gtest/gtest.h>

#include <memory>
#include <set>

#include "recording.h"
#include "robots/bipedal_walker/player.h"

namespace walker::bipedal_walker {
namespace {

std::unique_ptr<Stepper> next_session(Recording& recording) {
  const auto id = recording.next<std::string>();
  return std::make_unique<Stepper>(id, Parameters{{"reuse_world", recording.next<bool>()}});
}

/// Compares every observation, reward and flag. Each session resets one environment several times.
TEST(Recordings, EveryStepHasGymnasiumsHash) {
  Recording recording("episodes.txt");
  std::unique_ptr<Stepper> walker;
  std::size_t episodes = 0;
  std::set<std::string> kinds;
  while (recording.has_more()) {
    if (recording.next<std::string>() == "session") {
      walker = next_session(recording);
      continue;
    }
    const Headline episode(recording);
    SCOPED_TRACE(walker->environment->specification().id + " " + episode.kind + " seed " +
                 episode.seed + ", episode " + std::to_string(episodes) + " of the recording");
    auto rows = play(*walker, episode.reset_seed(), Actions(episode.kind, episode.action_seed));
    ASSERT_EQ(rows.size(), episode.steps + 1);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      // With float64 actions, Gymnasium rounds rewards differently, so they are not compared.
      if (episode.kind == "double") rows[i][kObservationSize] = 0;
      ASSERT_EQ(short_hash(rows[i]), recording.next_hexadecimal()) << "step " << i;
    }
    kinds.insert(episode.kind);
    ++episodes;
  }
  EXPECT_GE(episodes, 300U);
  EXPECT_EQ(kinds.size(), 7U);
}

/// Compares the values instead of hashes, so that failures show the difference.
TEST(Recordings, FullEpisodesAreEqual) {
  Recording recording("full_episodes.txt");
  std::unique_ptr<Stepper> walker;
  std::size_t steps = 0;
  while (recording.has_more()) {
    if (recording.next<std::string>() == "session") {
      walker = next_session(recording);
      continue;
    }
    const Headline episode(recording);
    SCOPED_TRACE(episode.kind + " seed " + episode.seed);
    replay<Actions>(episode, *walker, [&](std::size_t i, const std::vector<double>& action) {
      for (const double value : action) ASSERT_EQ(to_bits(value), to_bits(recording.next_float()));
      const std::vector<double> row = walker->row();
      for (std::size_t k = 0; k < row.size(); ++k) {
        const double expected =
            k <= kObservationSize ? recording.next_float() : recording.next<double>();
        ASSERT_EQ(to_bits(row[k]), to_bits(expected))
            << "step " << i << ", number " << k << ": " << row[k] << " instead of " << expected;
      }
    });
    if (HasFatalFailure()) return;
    ASSERT_TRUE(walker->has_ended());
    steps += episode.steps;
  }
  EXPECT_GT(steps, 2500U);
}

}  // namespace
}  // namespace walker::bipedal_walker
