// The replay repeats recorded episodes and reports differences, gaps, and what cannot be compared.
#include <gtest/gtest.h>
#include <std_msgs/Float64.h>

#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "base/engine_release.h"
#include "replay/replay_bags.h"
#include "ros/message_conversions.h"
#include "test_name.h"

namespace walker::test {
namespace {

using walker_sim::EpisodeRecord;

constexpr const char* kId = "BipedalWalker-v3";

class ReplayOfEach : public BagTest, public testing::WithParamInterface<const char*> {};

TEST_P(ReplayOfEach, EqualEpisodes) {
  const Session session = three_episodes(GetParam());
  const Outcome outcome = replay_of(session);
  EXPECT_TRUE(outcome.is_equal) << outcome;
  const Specification& specification = session.simulation().specification();
  EXPECT_PRED2(starts_with, outcome.text,
               "/walker_sim: " + specification.id + " on " + specification.engine + " " +
                   engine_release(specification.engine_version) + "\n");
  EXPECT_PRED2(matches, outcome.line(1), "^ *42 +20 .*truncated: 20 steps +equal$");
  EXPECT_PRED2(matches, outcome.line(2), "^continued +20 .*truncated: 20 steps +equal$");
  EXPECT_PRED2(matches, outcome.line(3),
               "^18446744073709551615 +10 .*reset before its end +equal$");
  EXPECT_PRED2(ends_with, outcome.text, "\n3 episodes equal to the bit (50 steps)\n");
}

TEST_P(ReplayOfEach, EpisodeToItsTermination) {
  Session session(GetParam());
  session.reset(3);
  session.walk();
  ASSERT_TRUE(session.state().terminated);
  const Outcome outcome = replay_of(session);
  EXPECT_TRUE(outcome.is_equal) << outcome;
  EXPECT_PRED2(contains, outcome.line(1), session.state().end_reason);
}

TEST_P(ReplayOfEach, RestoredEpisodesAreRepeatedFromTheirReset) {
  Session session(GetParam(), short_episodes(GetParam()));
  session.reset(7);
  session.walk(8);
  const auto running = session.simulation().record();
  session.walk();
  const auto ended = session.simulation().record();
  session.restore(running);
  session.walk();
  session.restore(ended);
  const Outcome outcome = replay_of(session);
  EXPECT_TRUE(outcome.is_equal) << outcome;
  for (const int episode : {1, 2, 3}) {
    EXPECT_PRED2(matches, outcome.line(episode), "^ *7 +20 .*truncated: 20 steps  +equal$");
  }
}

TEST_P(ReplayOfEach, DifferencesAreReportedWithTheirStep) {
  const std::size_t size = make(GetParam())->specification().action_size();
  const std::size_t eleventh = 10 * size;
  const Changes<EpisodeRecord> cases = {
      {[](auto& r) { r.checksums[0] ^= 1U; }, "differs at step 0 of the record: checksum = "},
      {[](auto& r) { r.checksums[7] ^= 1U; }, "differs at step 7 of the record: checksum = "},
      {[](auto& r) { r.checksums[20] ^= 1U; }, "differs at step 20 of the record: checksum = "},
      {[&](auto& r) { r.actions[eleventh] *= -1; }, "differs at step 11 of the record: checksum"},
      {[&](auto& r) { r.actions[eleventh] = std::numeric_limits<double>::infinity(); },
       "differs at step 11 of the record: action[0]"},
      {[](auto& r) { ++r.episode.length; }, "differs at its beginning: actions has "},
      {[](auto& r) { r.episode.end_reason = "terminated: bored"; },
       "differs at its end: end_reason = terminated: bored; repeated here it is truncated: 20 "
       "steps"},
      {[](auto& r) { r.episode.generator_state[0] ^= 1U; }, "differs at step 0 of the record"},
      {[](auto& r) { r.episode.generator_state[3] ^= 1U; },  // the increment must be odd
       "differs at its beginning: "},
  };
  for (const auto& [change, words] : cases) {
    SCOPED_TRACE(words);
    Session session = three_episodes(GetParam());
    change(session.records()[1]);
    const Outcome outcome = replay_of(session);
    EXPECT_FALSE(outcome.is_equal);
    EXPECT_PRED2(ends_with, outcome.line(1), "  equal");
    EXPECT_PRED2(contains, outcome.line(2), words);
    EXPECT_PRED2(ends_with, outcome.line(3), "  equal");
    EXPECT_PRED2(ends_with, outcome.text,
                 "\n2 episodes equal to the bit (30 steps), 1 differing\n");
  }
}

/// The record has what was drawn, whatever the world of later episodes.
TEST_P(ReplayOfEach, EpisodesInAWorld) {
  Session session(GetParam(), short_episodes(GetParam()));
  const World world{{"gravity", {-11, -8}},        {"friction_scale", {0.5, 1}},
                    {"push_interval", {0.1, 0.1}}, {"observation_delay", {0, 0.1}},
                    {"action_noise", {0.1, 0.1}},  {"joint_position_noise", {0, 0.1}}};
  session.set_world(world);
  session.reset(42);
  session.walk();
  session.reset();
  session.walk();
  ASSERT_EQ(session.records()[1].episode.world.size(), world.size());
  session.set_world({});
  session.reset(42);
  session.walk();
  EXPECT_TRUE(session.records()[2].episode.world.empty());
  EXPECT_NE(session.records()[2].checksums, session.records()[0].checksums);
  const Outcome outcome = replay_of(session);
  EXPECT_TRUE(outcome.is_equal) << outcome;
}

TEST_P(ReplayOfEach, PushesByHand) {
  Session session(GetParam(), short_episodes(GetParam()));
  session.reset(3);
  for (std::uint32_t i = 0; i < 5; ++i) {
    session.push({i % 4, 30.0 - 10 * i, 5.0 * i, 1.0});
    session.push({4, -20, 10, 0});
    session.walk(2);
  }
  session.walk();
  ASSERT_EQ(session.records()[0].pushes.size(), 10U);
  EXPECT_EQ(session.records()[0].pushes[3].step, 3U);
  EXPECT_EQ(session.records()[0].pushes[3].link, 4U);
  const Outcome outcome = replay_of(session);
  EXPECT_TRUE(outcome.is_equal) << outcome;
  EXPECT_PRED2(ends_with, outcome.line(1), "  equal");
  const Changes<EpisodeRecord> cases = {
      {[](auto& r) { r.pushes[3].force_x += 1; }, "differs at step 3 of the record: checksum"},
      {[](auto& r) { r.pushes.clear(); }, "differs at step 1 of the record: checksum"},
      {[](auto& r) { r.pushes[9].step = 21; }, "pushes[9].step = 21; must be in [1, 20]"}};
  const EpisodeRecord recorded = session.records()[0];
  for (const auto& [change, words] : cases) {
    session.records()[0] = recorded;
    change(session.records()[0]);
    EXPECT_PRED2(contains, replay_of(session).line(1), words);
  }
}

TEST_F(BagTest, CoordinatesThatWereSet) {
  Session session("Hopper-v5", short_episodes("Hopper-v5"));
  session.set_world({{"observation_delay", {0.03, 0.03}}, {"dropout", {0.3, 0.3}}});
  session.reset(3);
  const std::vector<double> still(6);
  for (int i = 0; i < 5; ++i) {
    session.set_coordinates({0, 1.25, 0.01 * i, 0, 0, 0}, still);
    if (i == 3) session.set_coordinates({0, 1.2, 0, 0, 0, 0}, still);
    session.walk(2);
  }
  session.set_coordinates({9, 1.25, 0, 0, 0, 0}, still);  // of the last step
  session.abandon();
  ASSERT_EQ(session.records()[0].coordinates.size(), 7U);
  const Outcome outcome = replay_of(session);
  EXPECT_TRUE(outcome.is_equal) << outcome;
  const Changes<EpisodeRecord> cases = {
      {[](auto& r) { r.coordinates[2].position[2] += 1e-9; }, "differs at step 4 of the record: "},
      {[](auto& r) { r.coordinates[6].velocity[0] = 1; }, "differs at step 10 of the record: "},
      {[](auto& r) { r.coordinates.pop_back(); }, "differs at step 10 of the record: checksum"},
      {[](auto& r) { r.coordinates.erase(r.coordinates.begin() + 3); }, "differs at step 6 of the"},
      {[](auto& r) { r.coordinates[6].step = 11; }, "coordinates[6].step = 11; must be in [8, 10]"},
      {[](auto& r) { r.coordinates[0].position.clear(); }, "coordinates[0]: qpos has 0 values"}};
  const EpisodeRecord recorded = session.records()[0];
  for (const auto& [change, words] : cases) {
    session.records()[0] = recorded;
    change(session.records()[0]);
    EXPECT_PRED2(contains, replay_of(session).line(1), words);
  }
}

TEST_P(ReplayOfEach, WorldsAreChecked) {
  const Changes<std::vector<walker_sim::WorldParameter>> cases = {
      {[](auto& world) { world[0].high += 1; }, "not compared: world parameter {gravity: ["},
      {[](auto& world) { world[0].low = world[0].high = NAN; },
       "not compared: world parameter gravity = .nan: must be finite"},
      {[](auto& world) { world.push_back(world[0]); },
       "not compared: world parameter gravity is given twice"},
      {[](auto& world) { world[0].name = "gravty"; }, "not compared: world parameter gravty = "},
      {[](auto& world) { world[0].low = world[0].high = -500; },
       "not compared: world parameter gravity = -500.0: must be in"},
      {[](auto& world) { world[0].low = world[0].high = -5; }, "differs at step "},
      {[](auto& world) { world.clear(); }, "differs at step "},
  };
  for (const auto& [change, words] : cases) {
    SCOPED_TRACE(words);
    Session session(GetParam(), short_episodes(GetParam()));
    session.set_world({{"gravity", {-11, -8}}});
    session.reset(3);
    session.walk();
    change(session.records()[0].episode.world);
    EXPECT_PRED2(contains, replay_of(session).line(1), words);
  }
}

INSTANTIATE_TEST_SUITE_P(Ids, ReplayOfEach,
                         testing::Values("BipedalWalker-v3", "BipedalWalkerHardcore-v3",
                                         "Walker2d-v4", "Walker2d-v5"),
                         kNameOfId);

using ReplayTest = BagTest;

TEST_F(ReplayTest, EpisodesThatCannotBeRepeatedAreNotCompared) {
  const Changes<EpisodeRecord> cases = {
      {[](auto& r) { r.spec.id = "BipedalWalker-v4"; },
       "environment BipedalWalker-v4: unknown; did you mean BipedalWalker-v3?"},
      {[](auto& r) { r.spec.parameter_names[0] = "softcore"; }, "parameter softcore = "},
      {[](auto& r) { r.spec.parameter_values.pop_back(); }, "parameter_values has "},
      {[](auto& r) { r.spec.engine = "Bullet"; },
       "engine = Bullet in the record; here it is Box2D"},
      {[](auto& r) { r.spec.engine_version = "0.0.7"; },
       "engine_version = 0.0.7 in the record; here it is "},
      {[](auto& r) {
         r.spec.id = "Walker2d-v5";
         r.spec.parameter_names = {"xml_file"};
         r.spec.parameter_values = {"/nowhere/model.xml"};
       },
       "parameter xml_file = /nowhere/model.xml: "},
      {[](auto& r) {
         auto& names = r.spec.parameter_names;
         const auto found = std::find(names.begin(), names.end(), "reuse_world");
         r.spec.parameter_values[found - names.begin()] = "true";
       },
       "reuse_world = true: an episode depends on those before it"},
      {[](auto& r) { r.checksums.clear(); }, "the record has no checksums"}};
  for (const auto& [change, words] : cases) {
    SCOPED_TRACE(words);
    Session session = three_episodes();
    change(session.records()[2]);
    Outcome outcome = replay_of(session);
    EXPECT_TRUE(outcome.is_equal) << outcome;
    EXPECT_PRED2(contains, outcome.line(3), "  not compared: " + words);
    EXPECT_PRED2(ends_with, outcome.text,
                 "\n2 episodes equal to the bit (40 steps), 1 not compared\n");
    session.records().erase(session.records().begin(), session.records().begin() + 2);
    outcome = replay_of(session);
    EXPECT_FALSE(outcome.is_equal) << outcome;
    EXPECT_PRED2(ends_with, outcome.text, "\nNothing was compared\n");
  }
}

TEST_F(ReplayTest, EpisodesMissingWithinTheRecordingAreReported) {
  Session session = three_episodes();
  for (int i = 0; i < 4; ++i) session.reset();
  session.abandon();
  auto& records = session.records();
  ASSERT_EQ(records.size(), 7U);
  records.erase(records.begin() + 4, records.begin() + 6);
  records.erase(records.begin() + 2);
  records.erase(records.begin());  // before the recording
  const Outcome outcome = replay_of(session);
  EXPECT_FALSE(outcome.is_equal);
  EXPECT_EQ(outcome.line(1), "(no line)");
  EXPECT_PRED2(ends_with, outcome.line(3), "  not in the bag");
  EXPECT_PRED2(matches, outcome.text, "\n *5-6  .*not in the bag\n");
  EXPECT_PRED2(matches, outcome.line(7), " 0 .*reset before its end +equal$");
  EXPECT_PRED2(ends_with, outcome.text, "3 episodes equal to the bit (20 steps), 3 missing\n");
}

TEST_F(ReplayTest, RestartedServer) {
  Session session("Walker2d-v5");
  for (int i = 0; i < 2; ++i) {
    session.reset(5);
    session.walk(10);
  }
  session.abandon();
  session.start("Walker2d-v5", {{"healthy_reward", 2.0}});
  session.reset(6);
  session.walk(10);
  session.abandon();
  Outcome outcome = replay_of(session);
  EXPECT_TRUE(outcome.is_equal) << outcome;
  const std::string heading = "/walker_sim: Walker2d-v5 on MuJoCo";
  EXPECT_NE(outcome.text.find(heading), outcome.text.rfind(heading)) << outcome;
  EXPECT_PRED2(ends_with, outcome.text, "\n3 episodes equal to the bit (30 steps)\n");
  std::swap(session.records()[1].spec, session.records()[2].spec);
  outcome = replay_of(session);
  EXPECT_FALSE(outcome.is_equal);
  EXPECT_PRED2(ends_with, outcome.text, "\n1 episode equal to the bit (10 steps), 2 differing\n");
}

TEST_F(ReplayTest, PartsOfARecordingAreReadInTheirOrderAndOverlapsOnce) {
  const Session session = three_episodes();
  {
    rosbag::Bag first(path("0.bag"), rosbag::bagmode::Write);
    rosbag::Bag second(path("1.bag"), rosbag::bagmode::Write);
    session.write(first, 0, 2);
    session.write(second, 1, 3);
  }
  const std::string expected = replay_of(session).text;
  EXPECT_EQ(replay_bags({path("0.bag"), path("1.bag")}).text, expected);
  EXPECT_EQ(replay_bags({path("1.bag"), path("0.bag")}).text, expected);
  EXPECT_EQ(replay_bags({path("0.bag"), path("1.bag"), path("1.bag")}).text, expected);
}

TEST_F(ReplayTest, WalkersAreDistinguishedByTheirNodesOrElseTheirTopics) {
  Session one(kId);
  Session two("Walker2d-v4");
  for (Session* session : {&one, &two}) {
    session->reset(1);
    session->walk(5);
    session->abandon();
  }
  two.records()[0].checksums[2] ^= 1U;
  for (const bool has_nodes : {true, false}) {
    {
      rosbag::Bag bag(path(), rosbag::bagmode::Write);
      one.write(bag, 0, 1, has_nodes ? "/one" : "", has_nodes ? "episode_record" : "/one");
      two.write(bag, 0, 1, has_nodes ? "/two" : "", has_nodes ? "episode_record" : "/two");
    }
    const Outcome outcome = replay_bags({path()});
    EXPECT_FALSE(outcome.is_equal);
    EXPECT_PRED2(starts_with, outcome.text, "/one: BipedalWalker-v3 on Box2D");
    EXPECT_PRED2(contains, outcome.text, "\n/two: Walker2d-v4 on MuJoCo");
    EXPECT_PRED2(ends_with, outcome.text, "\n1 episode equal to the bit (5 steps), 1 differing\n");
  }
}

TEST_F(ReplayTest, BagsWithoutEpisodes) {
  { const rosbag::Bag empty(path("empty.bag"), rosbag::bagmode::Write); }
  {
    rosbag::Bag bag(path("other.bag"), rosbag::bagmode::Write);
    bag.write("/episode_record", ros::Time(1), std_msgs::Float64());
  }
  for (const char* name : {"empty.bag", "other.bag"}) {
    const Outcome outcome = replay_bags({path(name)});
    EXPECT_FALSE(outcome.is_equal);
    EXPECT_PRED2(starts_with, outcome.text, "No episode in the bag");
  }
}

}  // namespace
}  // namespace walker::test
