// Episodes recorded from Gymnasium 1.4.0 on MuJoCo 2.2.2, reproduced bit by bit.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <memory>
#include <set>

#include "base/parameter_text.h"
#include "recording.h"
#include "robots/mujoco/player.h"
#include "stepper.h"

namespace walker::mujoco {
namespace {

std::unique_ptr<Stepper> next_session(Recording& recording) {
  const auto id = recording.next<std::string>();
  std::vector<std::string> assignments(recording.next<std::size_t>());
  for (std::string& assignment : assignments) assignment = recording.next<std::string>();
  return std::make_unique<Stepper>(id, parse_assignments(parameter_descriptions(id), assignments));
}

/// Row as in the recording. With float64 actions, Gymnasium does not round the control cost to
/// single precision, so reward and reward_ctrl are 0 for the kind `double`.
std::vector<double> comparable_row(const Stepper& walker, const std::string& kind) {
  std::vector<double> row = walker.row();
  if (kind != "double") return row;
  const std::vector<std::string>& names = walker.environment->specification().info_names;
  row[walker.observation.size()] = 0;
  const auto found = std::find(names.begin(), names.end(), "reward_ctrl");
  if (found != names.end()) row[row.size() - static_cast<std::size_t>(names.end() - found)] = 0;
  return row;
}

struct Tally {
  std::size_t episodes = 0;
  std::size_t steps = 0;
  std::size_t falls = 0;
};

void compare_episode(Recording& recording, Stepper& walker, Tally& tally,
                     std::set<std::string>& kinds) {
  const Headline episode(recording);
  SCOPED_TRACE(walker.environment->specification().id + " " + episode.kind + " seed " +
               episode.seed + ", episode " + std::to_string(tally.episodes));
  replay<Actions>(episode, walker, [&](std::size_t i, const std::vector<double>& /*action*/) {
    ASSERT_EQ(short_hash(comparable_row(walker, episode.kind)), recording.next_hexadecimal())
        << "at step " << i;
    ASSERT_EQ(walker.has_ended(), i == episode.steps) << "at step " << i;
  });
  kinds.insert(episode.kind);
  ++tally.episodes;
  tally.steps += episode.steps;
  tally.falls += walker.result.terminated ? 1 : 0;
}

/// The parameter is the prefix of the recording's file name.
class Recordings : public testing::TestWithParam<const char*> {};

INSTANTIATE_TEST_SUITE_P(Robots, Recordings, testing::Values("walker2d", "hopper"),
                         [](const auto& robot) { return std::string(robot.param); });

/// Compares every observation, reward, flag and info. Each session resets one environment several
/// times.
TEST_P(Recordings, EveryStepHasGymnasiumsHash) {
  Recording recording(std::string(GetParam()) + "_episodes.txt");
  std::unique_ptr<Stepper> walker;
  std::map<std::string, Tally> tallies;
  std::set<std::string> kinds;
  while (recording.has_more()) {
    if (recording.next<std::string>() == "session") {
      walker = next_session(recording);
    } else {
      compare_episode(recording, *walker, tallies[walker->environment->specification().id], kinds);
      if (HasFatalFailure()) return;
    }
  }
  for (const auto& [id, tally] : tallies) {
    SCOPED_TRACE(id);
    EXPECT_GE(tally.episodes, 120U);
    EXPECT_GE(tally.steps, 30000U);
    EXPECT_GE(tally.falls, 100U);
    EXPECT_GE(tally.episodes - tally.falls, 20U);
  }
  EXPECT_EQ(tallies.size(), 2U);
  EXPECT_EQ(kinds.size(), 7U);
}

/// Compares the values instead of hashes, so that failures show the difference.
TEST_P(Recordings, FullEpisodesAreEqual) {
  Recording recording(std::string(GetParam()) + "_full_episodes.txt");
  std::unique_ptr<Stepper> walker;
  std::size_t values = 0;
  while (recording.has_more()) {
    if (recording.next<std::string>() == "session") {
      walker = next_session(recording);
      continue;
    }
    const Headline episode(recording);
    SCOPED_TRACE(walker->environment->specification().id + " " + episode.kind);
    replay<Actions>(episode, *walker, [&](std::size_t i, const std::vector<double>& action) {
      for (const double value : action) ASSERT_EQ(to_bits(value), to_bits(recording.next_float()));
      const std::vector<double> row = walker->row();
      const std::size_t first_flag = walker->observation.size() + 1;
      for (std::size_t k = 0; k < row.size(); ++k) {
        const bool is_flag = k == first_flag || k == first_flag + 1;
        const double expected = is_flag ? recording.next<double>() : recording.next_double();
        ASSERT_EQ(to_bits(row[k]), to_bits(expected))
            << "step " << i << ", number " << k << ": " << row[k] << " instead of " << expected;
        ++values;
      }
    });
    if (HasFatalFailure()) return;
    ASSERT_TRUE(walker->has_ended());
  }
  EXPECT_GT(values, std::string(GetParam()) == "walker2d" ? 15000U : 13000U);
}

}  // namespace
}  // namespace walker::mujoco
