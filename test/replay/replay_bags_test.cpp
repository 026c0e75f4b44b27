// Incomplete bags, bags of other environments, and unreadable bags.
#include <std_msgs/Float64.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <regex>
#include <string>
#include <vector>

#include "base/engine_release.h"
#include "replay/replay_bags.h"

namespace walker::test {
namespace {

using walker_sim::EnvironmentSpec;
using walker_sim::Episode;
using walker_sim::EpisodeRecord;
using walker_sim::Transition;

constexpr const char* kId = "BipedalWalker-v3";

class ReplayBagsTest : public BagTest {
 protected:
  static bool is_step(const Transition& message, std::uint32_t episode, std::uint32_t first,
                      std::uint32_t last) {
    return message.episode == episode && message.step >= first && message.step <= last;
  }
};

// ---------------------------------------------------------------- incomplete bags

TEST_F(ReplayBagsTest, ABeginningBeforeTheRecordingIsNoFailure) {
  Session session = three_episodes(kId);
  session.lose<Transition>([](const Transition& m) { return is_step(m, 1, 0, 4); });
  const Outcome outcome = replay_of(session);
  EXPECT_TRUE(outcome.is_equal) << outcome;
  EXPECT_TRUE(ends_with(outcome.line(1), "  not compared: steps 0 to 4 are not in the bag"))
      << outcome;
  EXPECT_TRUE(outcome.says("\n2 episodes equal to the bit (30 steps), 1 not compared\n"))
      << outcome;
}

TEST_F(ReplayBagsTest, LostStepsAreAFailure) {
  struct Case {
    std::uint32_t first;
    std::uint32_t last;
    std::string words;
  };
  const std::vector<Case> cases = {
      {10, 12, "  equal up to step 9; steps 10 to 12 are not in the bag"},
      {1, 1, "  equal up to step 0; step 1 is not in the bag"},
      {20, 20, "  equal up to step 19; step 20 is not in the bag"},  // known from the episode's end
      {15, 20, "  equal up to step 14; steps 15 to 20 are not in the bag"},
      {0, 0, "  not compared: step 0 is not in the bag"},
      {0, 19, "  not compared: steps 0 to 19 are not in the bag"}};
  for (const Case& one : cases) {
    Session session = three_episodes(kId);
    session.lose<Transition>(
        [&](const Transition& m) { return is_step(m, 2, one.first, one.last); });
    const Outcome outcome = replay_of(session);
    EXPECT_FALSE(outcome.is_equal) << outcome;
    EXPECT_TRUE(ends_with(outcome.line(2), one.words)) << outcome;
    EXPECT_TRUE(outcome.says("\n2 episodes equal to the bit (30 steps), 1 with steps missing\n"))
        << outcome;
  }
}

/// A stopped recorder may have received more on one topic than on another.
TEST_F(ReplayBagsTest, AnEndAfterTheRecordingIsNoFailure) {
  Session session = three_episodes(kId);
  session.walk();
  session.lose<Transition>([](const Transition& m) { return is_step(m, 3, 8, 20); });
  const Outcome outcome = replay_of(session);
  EXPECT_TRUE(outcome.is_equal) << outcome;
  EXPECT_TRUE(ends_with(outcome.line(3), "  equal up to step 7, where the recording ends"))
      << outcome;
  EXPECT_TRUE(outcome.says("\n3 episodes equal to the bit (47 steps)\n")) << outcome;
}

TEST_F(ReplayBagsTest, LostStepsOfTheLastEpisodeAreAFailure) {
  Session session = three_episodes(kId);
  session.lose<Transition>([](const Transition& m) { return is_step(m, 3, 4, 6); });
  const Outcome outcome = replay_of(session);
  EXPECT_FALSE(outcome.is_equal) << outcome;
  EXPECT_TRUE(ends_with(outcome.line(3), "  equal up to step 3; steps 4 to 6 are not in the bag"))
      << outcome;
}

TEST_F(ReplayBagsTest, LostEpisodesAreAFailure) {
  Session session = three_episodes(kId);
  for (int i = 0; i < 3; ++i) session.reset();
  session.walk(5);
  session.lose<Transition>([](const Transition& m) { return m.episode == 2; });
  session.lose<Transition>([](const Transition& m) { return m.episode == 4 || m.episode == 5; });
  const Outcome outcome = replay_of(session);
  EXPECT_FALSE(outcome.is_equal) << outcome;
  EXPECT_TRUE(ends_with(outcome.line(2), "  not in the bag")) << outcome;
  EXPECT_TRUE(outcome.says("\n    4-5  ")) << outcome;
  EXPECT_TRUE(ends_with(outcome.line(6), "  equal")) << outcome;
  EXPECT_TRUE(outcome.says("3 episodes equal to the bit (35 steps), 3 with steps missing"))
      << outcome;
}

TEST_F(ReplayBagsTest, ADifferenceBeforeAGapIsFound) {
  Session session = three_episodes(kId);
  falsify(session.transition(2, 3).reward);
  session.lose<Transition>([](const Transition& m) { return is_step(m, 2, 10, 12); });
  EXPECT_NE(replay_of(session).line(2).find("  differs at step 3: reward"), std::string::npos);
}

TEST_F(ReplayBagsTest, NaNIsComparedByItsBits) {
  Session session("Walker2d-v5");
  session.reset(1);
  std::vector<double>& info = session.transition(1, 0).info;
  ASSERT_TRUE(std::isnan(info.back()));
  EXPECT_TRUE(replay_of(session).is_equal);
  falsify(info.back());
  const Outcome outcome = replay_of(session);
  EXPECT_FALSE(outcome.is_equal) << outcome;
  EXPECT_TRUE(
      outcome.says(" (reward_survive) is nan (0x7ff8000000000001), repeated nan "
                   "(0x7ff8000000000000)"))
      << outcome;
}

TEST_F(ReplayBagsTest, AnEpisodeMayBeCutShortByAReset) {
  Session session(kId);
  session.reset(1);
  session.walk(7);
  session.reset();
  const Outcome outcome = replay_of(session);
  EXPECT_TRUE(outcome.is_equal) << outcome;
  EXPECT_NE(outcome.line(1).find("reset before its end   equal"), std::string::npos) << outcome;
}

TEST_F(ReplayBagsTest, WithoutItsBeginningAnEpisodeIsNotCompared) {
  Session session = three_episodes(kId);
  session.lose<Episode>([](const Episode& m) { return m.episode == 2; });
  Outcome outcome = replay_of(session);
  EXPECT_TRUE(outcome.is_equal) << outcome;
  EXPECT_TRUE(
      ends_with(outcome.line(2), "not compared: its beginning is not in the bag (topic episode)"))
      << outcome;
  session.lose<Episode>([](const Episode&) { return true; });
  outcome = replay_of(session);
  EXPECT_FALSE(outcome.is_equal) << outcome;
  EXPECT_TRUE(ends_with(outcome.text, "\nNothing was compared\n")) << outcome;
}

TEST_F(ReplayBagsTest, WithoutItsRecordARestoredEpisodeIsNotCompared) {
  Session session(kId);
  session.reset(7);
  session.walk(8);
  session.restore(session.simulation().record());
  session.walk(2);
  session.lose<EpisodeRecord>([](const EpisodeRecord&) { return true; });
  const Outcome outcome = replay_of(session);
  EXPECT_TRUE(outcome.is_equal) << outcome;
  EXPECT_TRUE(ends_with(outcome.line(2), "whose record is not in the bag (topic restored)"))
      << outcome;
}

TEST_F(ReplayBagsTest, AFalseRecordIsFound) {
  Session session(kId);
  session.reset(7);
  session.walk(8);
  session.restore(session.simulation().record());
  session.walk(2);
  session.all<EpisodeRecord>()[0]->actions[5] *= -1;
  Outcome outcome = replay_of(session);
  EXPECT_FALSE(outcome.is_equal) << outcome;
  EXPECT_NE(outcome.line(2).find("differs at step 8: observation["), std::string::npos) << outcome;
  session.all<EpisodeRecord>()[0]->actions.resize(30);
  outcome = replay_of(session);
  EXPECT_NE(outcome.line(2).find("differs at step 8, which is refused: action has 2 values"),
            std::string::npos)
      << outcome;
  session.all<EpisodeRecord>()[0]->actions.resize(28);
  outcome = replay_of(session);
  EXPECT_NE(outcome.line(2).find("differs at step 8: step is 8, repeated 7"), std::string::npos)
      << outcome;
}

TEST_F(ReplayBagsTest, WithoutASpecificationNothingIsCompared) {
  Session session = three_episodes(kId);
  session.lose<EnvironmentSpec>([](const EnvironmentSpec&) { return true; });
  const Outcome outcome = replay_of(session);
  EXPECT_FALSE(outcome.is_equal) << outcome;
  EXPECT_TRUE(outcome.says("not compared: no specification in the bag (topic spec)\n")) << outcome;
  EXPECT_TRUE(ends_with(outcome.text, "\nNothing was compared\n")) << outcome;
}

TEST_F(ReplayBagsTest, BagsWithoutAWalker) {
  { const rosbag::Bag empty(path("empty.bag"), rosbag::bagmode::Write); }
  {
    rosbag::Bag bag(path("other.bag"), rosbag::bagmode::Write);
    bag.write("/transition", ros::Time(1), std_msgs::Float64());
  }
  for (const char* name : {"empty.bag", "other.bag"}) {
    const Outcome outcome = replay_bags({path(name)});
    EXPECT_FALSE(outcome.is_equal);
    EXPECT_TRUE(outcome.says("No walker in the bag")) << outcome;
    EXPECT_TRUE(outcome.says("walker_sim/Transition")) << outcome;
  }
}

// ---------------------------------------------------------------- other environments

TEST_F(ReplayBagsTest, WhatCannotBeMadeHereIsNamed) {
  struct Case {
    std::function<void(EnvironmentSpec&)> change;
    std::string words;
  };
  const std::vector<Case> cases = {
      {[](EnvironmentSpec& s) { s.id = "BipedalWalker-v4"; },
       "not compared: environment BipedalWalker-v4: unknown; did you mean BipedalWalker-v3?"},
      {[](EnvironmentSpec& s) { s.parameter_names[0] = "softcore"; },
       "not compared: parameter softcore = "},
      {[](EnvironmentSpec& s) { s.parameter_values.pop_back(); },
       "not compared: parameter_values has "},
      {[](EnvironmentSpec& s) {
         s.id = "Walker2d-v5";
         s.parameter_names = {"xml_file"};
         s.parameter_values = {"/nowhere/model.xml"};
       },
       "not compared: parameter xml_file = /nowhere/model.xml: "}};
  for (const Case& one : cases) {
    Session session = three_episodes(kId);
    one.change(*session.all<EnvironmentSpec>()[0]);
    const Outcome outcome = replay_of(session);
    EXPECT_FALSE(outcome.is_equal) << outcome;
    EXPECT_TRUE(outcome.says("\n" + one.words)) << outcome;
    EXPECT_TRUE(ends_with(outcome.line(3), "  not compared")) << outcome;
    EXPECT_TRUE(ends_with(outcome.text, "\nNothing was compared\n")) << outcome;
  }
}

TEST_F(ReplayBagsTest, EpisodesThatDependOnOthersAreRefused) {
  Session session(kId, {{"reuse_world", true}});
  session.reset(1);
  session.walk(5);
  const Outcome outcome = replay_of(session);
  EXPECT_FALSE(outcome.is_equal) << outcome;
  EXPECT_TRUE(outcome.says("\nnot compared: its episodes depend on those before them")) << outcome;
  EXPECT_TRUE(outcome.says("reuse_world")) << outcome;
}

TEST_F(ReplayBagsTest, OtherVersionsAreSaidAndComparedAllTheSame) {
  const auto versions = {&EnvironmentSpec::engine, &EnvironmentSpec::engine_version,
                         &EnvironmentSpec::version};
  for (const auto field : versions) {
    Session session = three_episodes(kId);
    (*session.all<EnvironmentSpec>()[0]).*field = "0.0.7";
    falsify(session.transition(2, 3).reward);
    const Outcome outcome = replay_of(session);
    EXPECT_TRUE(std::regex_search(
        outcome.text, std::regex("\nrecorded with [^\n]*0\\.0\\.7[^\n]*; repeated with ")))
        << outcome;
    EXPECT_TRUE(outcome.says("2 episodes equal to the bit (30 steps), 1 differing")) << outcome;
  }
  EXPECT_FALSE(replay_of(three_episodes(kId)).says("recorded with"));
}

TEST_F(ReplayBagsTest, AnotherLibmIsSaidAndComparedAllTheSame) {
  Session session = three_episodes("Walker2d-v5");
  std::string& version = session.all<EnvironmentSpec>()[0]->engine_version;
  const std::string own = libm_of(version);
  const std::string release = engine_release(version);
  version = release + ", libm: another, stepped by hand";
  const Outcome outcome = replay_of(session);
  EXPECT_TRUE(outcome.says("\nrecorded with libm: another; repeated with libm: " + own +
                           ": its sin, cos and pow differ in the last bit"))
      << outcome;
  EXPECT_TRUE(outcome.says("3 episodes equal to the bit")) << outcome;
  version = release;  // written by a release that did not record libm
  EXPECT_FALSE(replay_of(session).says("libm"));
}

// ---------------------------------------------------------------- unreadable bags

TEST_F(ReplayBagsTest, WhatCannotBeReadIsNamedWithWhatHelps) {
  const std::string missing = path("missing.bag");
  EXPECT_EQ(refusal_of({missing}), missing + ": no such file");
  EXPECT_EQ(refusal_of({path("")}), path("") + ": is not a file");
  for (const char* content : {"", "no bag", "#ROSBAG V2.0\n"}) {
    std::ofstream(path("text.bag")) << content;
    EXPECT_EQ(refusal_of({path("text.bag")}).rfind(path("text.bag") + ": is not a bag", 0), 0U)
        << content;
  }
  const std::string bag = write(three_episodes(kId));
  EXPECT_EQ(refusal_of({bag, bag}), bag + ": is given twice");
  const std::string cut = path("cut.bag");
  std::filesystem::copy(bag, cut);
  std::filesystem::resize_file(cut, std::filesystem::file_size(cut) / 2);
  EXPECT_EQ(refusal_of({bag, cut}).rfind(cut + ": is not a bag, or is cut off: ", 0), 0U);
}

TEST_F(ReplayBagsTest, ABagThatWasNotClosedIsToBeReindexed) {
  const std::string bag = write(three_episodes(kId));
  spoil(bag, [](std::string& bytes) {  // index offset, written when the bag is closed
    const std::string field = "index_pos=";
    bytes.replace(bytes.find(field) + field.size(), 8, std::string(8, '\0'));
  });
  EXPECT_EQ(refusal_of({bag}), bag +
                                   ": was not closed when it was recorded; make it readable by: "
                                   "rosbag reindex " +
                                   bag);
}

TEST_F(ReplayBagsTest, ADamagedBagIsNamed) {
  const std::string bag = write(three_episodes(kId));
  spoil(bag, [](std::string& bytes) {
    std::fill_n(bytes.begin() + static_cast<std::ptrdiff_t>(bytes.size() / 4), 2000, '\xff');
  });
  EXPECT_EQ(refusal_of({bag}).rfind(bag + ": is damaged: ", 0), 0U) << refusal_of({bag});
}

TEST_F(ReplayBagsTest, MessagesOfAnotherDefinitionAreNamed) {
  const std::string bag = write(three_episodes(kId));
  const std::string md5 = ros::message_traits::md5sum<Episode>();
  const std::string other(md5.size(), '0');
  spoil(bag, [&](std::string& bytes) {
    for (std::size_t at = 0; (at = bytes.find(md5, at)) != std::string::npos;) {
      bytes.replace(at, md5.size(), other);
    }
  });
  EXPECT_EQ(refusal_of({bag}), bag + ": topic /episode: walker_sim/Episode has the MD5 " + other +
                                   "; here it is " + md5 +
                                   ", so another version of walker_sim recorded it");
}

}  // namespace
}  // namespace walker::test
