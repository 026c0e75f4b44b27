// The replay finds differences of one bit, for each environment.
#include <gtest/gtest.h>

#include <cstdlib>
#include <functional>
#include <limits>
#include <regex>
#include <string>
#include <vector>

#include "base/engine_release.h"
#include "replay/replay_bags.h"

namespace walker::test {
namespace {

using walker_sim::Episode;

class ReplayOfEach : public BagTest, public testing::WithParamInterface<const char*> {};

TEST_P(ReplayOfEach, SoundEpisodesAreEqual) {
  const Session session = three_episodes(GetParam());
  const Outcome outcome = replay_of(session);
  EXPECT_TRUE(outcome.is_equal) << outcome;
  const Specification& specification = session.simulation().specification();
  EXPECT_EQ(outcome.text.rfind("/transition: " + specification.id + " on " + specification.engine +
                                   " " + engine_release(specification.engine_version) + "\n",
                               0),
            0U)
      << outcome;
  EXPECT_TRUE(std::regex_match(
      outcome.line(1),
      std::regex("                  42     20 +-?[0-9.]+  truncated: 20 steps +equal")))
      << outcome;
  EXPECT_TRUE(std::regex_search(outcome.line(2), std::regex("continued .*truncated.*  equal$")))
      << outcome;
  EXPECT_TRUE(std::regex_search(
      outcome.line(3), std::regex("^18446744073709551615 +10 .*goes on after the bag  equal$")))
      << outcome;
  EXPECT_TRUE(outcome.says("\n3 episodes equal to the bit (50 steps)\n")) << outcome;
}

TEST_P(ReplayOfEach, AnEpisodeToItsTermination) {
  Session session(GetParam());
  session.reset(3);
  session.walk();
  ASSERT_TRUE(session.simulation().state().terminated);
  const Outcome outcome = replay_of(session);
  EXPECT_TRUE(outcome.is_equal) << outcome;
  EXPECT_NE(outcome.line(1).find(session.simulation().state().end_reason + "  equal"),
            std::string::npos)
      << outcome;
}

TEST_P(ReplayOfEach, WhatDiffersIsFoundAtItsStep) {
  struct Case {
    std::function<void(Session&)> change;
    std::string words;
  };
  const std::vector<Case> cases = {
      {[](Session& s) { falsify(s.transition(2, 7).observation[2]); },
       "differs at step 7: observation[2] is "},
      {[](Session& s) { falsify(s.transition(2, 0).observation[0]); },
       "differs at step 0: observation[0] is "},
      {[](Session& s) {
         s.transition(2, 20).observation.back() = std::numeric_limits<double>::quiet_NaN();
       },
       "] is nan, repeated "},
      {[](Session& s) { s.transition(2, 7).observation.pop_back(); },
       "differs at step 7: size of observation is "},
      {[](Session& s) { falsify(s.transition(2, 5).reward); }, "differs at step 5: reward is "},
      {[](Session& s) { s.transition(2, 0).reward = -0.0; },
       "differs at step 0: reward is -0, repeated 0"},
      {[](Session& s) { falsify(s.transition(2, 19).episode_return); },
       "differs at step 19: episode_return is "},
      {[](Session& s) { s.transition(2, 4).terminated = 1; },
       "differs at step 4: terminated is true, repeated false"},
      {[](Session& s) { s.transition(2, 20).truncated = 0; },
       "differs at step 20: truncated is false, repeated true"},
      {[](Session& s) { s.transition(2, 4).info.push_back(0); },
       "differs at step 4: size of info is "},
      {[](Session& s) { s.transition(2, 3).error = "b2Assert"; },
       "differs at step 3: error is \"b2Assert\", repeated \"\""},
      // A changed action shows in the step that it causes. The sign is one bit.
      {[](Session& s) { s.transition(2, 11).action[0] *= -1; }, "differs at step 11: observation["},
      {[](Session& s) { s.transition(2, 11).action.pop_back(); },
       "differs at step 11, which is refused: action has "},
      {[](Session& s) { s.transition(2, 11).action[1] = std::numeric_limits<double>::infinity(); },
       "differs at step 11, which is refused: action[1]"},
      {[](Session& s) { s.all<Episode>()[3]->end_reason = "terminated: bored"; },
       "differs at the end: end_reason is \"terminated: bored\", repeated \"truncated: 20 steps\""},
      {[](Session& s) { falsify(s.all<Episode>()[3]->episode_return); },
       "differs at the end: episode_return is "},
      {[](Session& s) { s.all<Episode>()[3]->length = 19; },
       "differs at the end: length is 19, repeated 20"},
      {[](Session& s) { s.all<Episode>()[2]->generator_state[0] ^= 1U; }, "differs at step 0: obs"},
      {[](Session& s) { s.all<Episode>()[2]->generator_state[3] ^= 1U; },
       "differs at the beginning: "},  // the increment must be odd
      {[](Session& s) { s.all<Episode>()[2]->has_seed = 1; },
       "differs at the beginning: generator_state is not that of seed 0"},
  };
  for (const Case& one : cases) {
    Session session = three_episodes(GetParam());
    one.change(session);
    const Outcome outcome = replay_of(session);
    EXPECT_FALSE(outcome.is_equal) << one.words << "\n" << outcome;
    EXPECT_NE(outcome.line(2).find(one.words), std::string::npos) << one.words << "\n" << outcome;
    EXPECT_TRUE(ends_with(outcome.line(1), "  equal")) << outcome;
    EXPECT_TRUE(ends_with(outcome.line(3), "  equal")) << outcome;
    EXPECT_TRUE(outcome.says("\n2 episodes equal to the bit (30 steps), 1 differing\n")) << outcome;
  }
}

TEST_P(ReplayOfEach, TheDigitsTellWhatDiffers) {
  Session session = three_episodes(GetParam());
  const double repeated = session.transition(2, 7).observation[3];
  falsify(session.transition(2, 7).observation[3]);
  const double recorded = session.transition(2, 7).observation[3];
  const Outcome outcome = replay_of(session);
  std::smatch match;
  const std::string line = outcome.line(2);
  ASSERT_TRUE(
      std::regex_search(line, match, std::regex("observation\\[3\\] is (\\S+), repeated (\\S+)$")))
      << outcome;
  EXPECT_EQ(std::strtod(match[1].str().c_str(), nullptr), recorded);
  EXPECT_EQ(std::strtod(match[2].str().c_str(), nullptr), repeated);
}

TEST_P(ReplayOfEach, ARestoredEpisodeIsRepeatedFromItsRecord) {
  Session session(GetParam(), short_episodes(GetParam()));
  session.reset(7);
  session.walk(8);
  const auto running = session.simulation().record();
  session.walk();
  const auto ended = session.simulation().record();
  session.restore(running);
  session.walk();
  session.restore(ended);
  session.reset();
  session.walk(5);
  const Outcome outcome = replay_of(session);
  EXPECT_TRUE(outcome.is_equal) << outcome;
  EXPECT_TRUE(std::regex_search(
      outcome.line(2), std::regex("^ *7 +20 .*truncated: 20 steps  +equal, restored at step 8$")))
      << outcome;
  EXPECT_TRUE(std::regex_search(
      outcome.line(3), std::regex("^ *7 +20 .*truncated: 20 steps  +equal, restored at step 20$")))
      << outcome;
  EXPECT_TRUE(ends_with(outcome.line(4), "  equal")) << outcome;
}

INSTANTIATE_TEST_SUITE_P(Ids, ReplayOfEach,
                         testing::Values("BipedalWalker-v3", "BipedalWalkerHardcore-v3",
                                         "Walker2d-v4", "Walker2d-v5"),
                         [](const auto& each) {
                           std::string name = each.param;
                           name.erase(name.find('-'), 1);
                           return name;
                         });

}  // namespace
}  // namespace walker::test
