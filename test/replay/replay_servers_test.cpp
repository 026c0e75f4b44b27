// Bags of several servers, and recordings of several bags.
#include <algorithm>
#include <map>
#include <string>
#include <variant>
#include <vector>

#include "replay/replay_bags.h"

namespace walker::test {
namespace {

using walker_sim::EnvironmentSpec;
using walker_sim::Episode;
using walker_sim::Transition;

constexpr const char* kId = "BipedalWalker-v3";

using ReplayServersTest = BagTest;

/// Two consecutive servers with different parameters and the same episode numbers.
Session restarted(int first_episodes = 2) {
  Session session("Walker2d-v5");
  for (int i = 0; i < first_episodes; ++i) {
    session.reset(5);
    session.walk(10);
  }
  session.start("Walker2d-v5", {{"healthy_reward", 2.0}});
  session.reset(6);
  session.walk(10);
  return session;
}

TEST_F(ReplayServersTest, AServerMayBeStartedAgain) {
  for (const int first_episodes : {1, 2}) {
    const Outcome outcome = replay_of(restarted(first_episodes));
    EXPECT_TRUE(outcome.is_equal) << outcome;
    EXPECT_TRUE(outcome.says("its server ended")) << outcome;
    const int all = first_episodes + 1;
    EXPECT_TRUE(outcome.says(std::to_string(all) + " episodes equal to the bit (" +
                             std::to_string(10 * all) + " steps)\n"))
        << outcome;
  }
}

TEST_F(ReplayServersTest, AServerThatIsFoundLateIsNoFailure) {
  for (const int num_episodes : {1, 3}) {
    Session session("Walker2d-v5");
    session.reset(5);
    session.walk(3);
    const auto first = static_cast<std::ptrdiff_t>(session.entries().size());
    session.start("Walker2d-v5", {});
    for (int i = 0; i < num_episodes; ++i) session.reset(6);
    session.walk(10);
    // Keeps the second server's specification and last step, as if the others were lost.
    session.entries().erase(session.entries().begin() + first + 1, session.entries().end() - 1);
    const Outcome outcome = replay_of(session);
    EXPECT_TRUE(outcome.is_equal) << outcome;
    EXPECT_TRUE(outcome.says("  not compared: steps 0 to 9 are not in the bag")) << outcome;
  }
}

TEST_F(ReplayServersTest, TopicsTravelApart) {
  // The second server's specification reaches the recorder late, or before the first server's end.
  for (const int displacement : {+2, -2}) {
    Session session = restarted();
    auto& entries = session.entries();
    const auto is_spec = [](const Session::Entry& entry) {
      return std::holds_alternative<EnvironmentSpec>(entry.message);
    };
    const auto found = std::find_if(entries.begin() + 1, entries.end(), is_spec);
    ASSERT_NE(found, entries.end());
    Session::Entry moved = *found;
    const auto place = entries.erase(found) + displacement + (displacement > 0 ? 1 : 0);
    moved.time = place->time - ros::Duration(0, 1);
    entries.insert(place, moved);
    const Outcome outcome = replay_of(session);
    EXPECT_TRUE(outcome.is_equal) << outcome;
    EXPECT_TRUE(outcome.says("3 episodes equal to the bit (30 steps)\n")) << outcome;
  }
  Session session = three_episodes(kId);
  for (Session::Entry& entry : session.entries()) {
    if (std::holds_alternative<Episode>(entry.message)) entry.time += ros::Duration(0.07);
  }
  EXPECT_TRUE(replay_of(session).says("3 episodes equal to the bit (50 steps)\n"));
}

constexpr int kEpisodes = 4;
constexpr int kSteps = 12;                              // per episode
constexpr int kTransitions = kEpisodes * (kSteps + 1);  // per server

void play(Session& session) {
  for (int i = 0; i < kEpisodes; ++i) {
    session.reset(i);
    session.walk(kSteps);
  }
}

Session servers(const std::vector<double>& healthy_rewards) {
  const auto parameters = [&](std::size_t i) {
    return Parameters{{"healthy_reward", healthy_rewards[i]}, {"terminate_when_unhealthy", false}};
  };
  Session session("Walker2d-v4", parameters(0));
  play(session);
  for (std::size_t i = 1; i < healthy_rewards.size(); ++i) {
    session.start("Walker2d-v4", parameters(i));
    play(session);
  }
  return session;
}

/// Moves a server's specification later by `num_transitions`, or earlier if it is negative.
void delay_spec(Session& session, std::size_t server, int num_transitions) {
  auto& entries = session.entries();
  auto place = entries.begin();
  for (std::size_t num_specs = 0;; ++place) {
    if (std::holds_alternative<EnvironmentSpec>(place->message) && num_specs++ == server) break;
  }
  Session::Entry spec = *place;
  place = entries.erase(place);
  const auto is_transition = [](const Session::Entry& entry) {
    return std::holds_alternative<Transition>(entry.message);
  };
  for (; num_transitions < 0; ++num_transitions) {
    do --place;
    while (!is_transition(*place));
  }
  for (; num_transitions > 0; --num_transitions) {
    while (!is_transition(*place)) ++place;
    ++place;
  }
  spec.time = place == entries.end() ? entries.back().time + ros::Duration(1)
                                     : place->time - ros::Duration(0, 1);
  entries.insert(place, spec);
}

/// Repeats the specification after `num_transitions`, as a recorder that splits its bag repeats
/// latched messages.
void repeat_spec(Session& session, int num_transitions) {
  session.entries().insert(session.entries().begin(), session.entries().front());
  delay_spec(session, 1, num_transitions);
}

std::string all_equal(int num_servers) {
  return std::to_string(num_servers * kEpisodes) + " episodes equal to the bit (" +
         std::to_string(num_servers * kEpisodes * kSteps) + " steps)\n";
}

TEST_F(ReplayServersTest, ASpecificationMayComeLate) {
  for (const int delay : {-14, -2, 0, 1, 8, 13, 14, 30, kTransitions - 1, kTransitions}) {
    for (const auto& rewards : {std::vector<double>{1, 2}, std::vector<double>{1, 2, 3},
                                std::vector<double>{1, 1}, std::vector<double>{1, 1, 2}}) {
      if (delay < -kSteps && rewards[0] != rewards[1]) continue;  // an episode begins in between
      Session session = servers(rewards);
      delay_spec(session, 1, delay);
      const Outcome outcome = replay_of(session);
      EXPECT_TRUE(outcome.is_equal) << "after " << delay << " transitions\n" << outcome;
      const auto num_servers = static_cast<int>(rewards.size());
      EXPECT_TRUE(outcome.says(all_equal(num_servers))) << delay << "\n" << outcome;
    }
  }
}

TEST_F(ReplayServersTest, AllSpecificationsMayComeLate) {
  for (const int delay : {1, 8, 13, 30, kTransitions - 1, kTransitions}) {
    Session session = servers({1, 2, 3});
    for (const std::size_t server : {2, 1, 0}) delay_spec(session, server, delay);
    const Outcome outcome = replay_of(session);
    EXPECT_TRUE(outcome.says(all_equal(3))) << "after " << delay << " transitions\n" << outcome;
    EXPECT_TRUE(outcome.is_equal) << outcome;
  }
}

TEST_F(ReplayServersTest, TheOnlySpecificationMayComeLate) {
  for (const int delay : {1, 8, 13, 30, kTransitions}) {
    Session session = servers({2});
    delay_spec(session, 0, delay);
    const Outcome outcome = replay_of(session);
    EXPECT_TRUE(outcome.says(all_equal(1))) << "after " << delay << " transitions\n" << outcome;
    EXPECT_FALSE(outcome.says("its server ended")) << outcome;
  }
}

TEST_F(ReplayServersTest, ALateSpecificationHidesNoDifference) {
  for (const int delay : {0, 8, 30, kTransitions}) {
    Session session = servers({1, 2});
    delay_spec(session, 1, delay);
    const auto specs = session.all<EnvironmentSpec>();
    std::swap(specs[0]->parameter_values, specs[1]->parameter_values);
    const Outcome outcome = replay_of(session);
    EXPECT_FALSE(outcome.is_equal) << outcome;
    EXPECT_TRUE(outcome.says("0 episodes equal to the bit (0 steps), 8 differing\n")) << outcome;
  }
}

TEST_F(ReplayServersTest, ARepeatedSpecificationBeginsNothing) {
  for (const int place : {1, 8, 13, 14, 30, kTransitions}) {
    Session session = servers({1});
    repeat_spec(session, place);
    Outcome outcome = replay_of(session);
    EXPECT_TRUE(outcome.says(all_equal(1))) << "after " << place << " transitions\n" << outcome;
    EXPECT_FALSE(outcome.says("its server ended")) << outcome;
    // Steps lost elsewhere are still reported.
    session.lose<Transition>([](const Transition& m) { return m.episode == 4 && m.step == 6; });
    outcome = replay_of(session);
    EXPECT_FALSE(outcome.is_equal) << outcome;
    EXPECT_FALSE(outcome.says("its server ended")) << outcome;
  }
}

TEST_F(ReplayServersTest, ARepeatedSpecificationIsNotTheNextServers) {
  for (const int place : {1, 8, 13, 30}) {
    for (const int delay : {-2, 0, 1, 8, 13, 30, kTransitions}) {
      for (const auto& rewards : {std::vector<double>{1, 2}, std::vector<double>{1, 2, 3},
                                  std::vector<double>{1, 1}, std::vector<double>{1, 1, 2}}) {
        Session session = servers(rewards);
        delay_spec(session, 1, delay);
        repeat_spec(session, place);
        const Outcome outcome = replay_of(session);
        EXPECT_TRUE(outcome.is_equal)
            << "repeated after " << place << ", next after " << delay << "\n"
            << outcome;
        EXPECT_TRUE(outcome.says(all_equal(static_cast<int>(rewards.size())))) << outcome;
      }
    }
  }
}

TEST_F(ReplayServersTest, PartsOfARecordingAreOneRecording) {
  Session session = three_episodes(kId);
  // rosbag can repeat latched messages in each part.
  const Session::Entry spec = session.entries()[0];
  const std::size_t half = session.entries().size() / 2;
  Session::Entry repeated = spec;
  repeated.time = session.entries()[half].time;
  session.entries().insert(session.entries().begin() + static_cast<std::ptrdiff_t>(half), repeated);
  {
    rosbag::Bag first(path("0.bag"), rosbag::bagmode::Write);
    rosbag::Bag second(path("1.bag"), rosbag::bagmode::Write);
    session.write(first, 0, half);
    session.write(second, half, session.entries().size());
  }
  const std::string heading = "/transition: BipedalWalker-v3";
  for (const auto& paths : {std::vector<std::string>{path("0.bag"), path("1.bag")},
                            std::vector<std::string>{path("1.bag"), path("0.bag")}}) {
    const Outcome outcome = replay_bags(paths);
    EXPECT_TRUE(outcome.is_equal) << outcome;
    EXPECT_TRUE(outcome.says("3 episodes equal to the bit (50 steps)\n")) << outcome;
    EXPECT_EQ(outcome.text.find(heading), outcome.text.rfind(heading)) << outcome;
  }
  const Outcome alone = replay_bags({path("0.bag")});
  EXPECT_TRUE(alone.is_equal) << alone;
  EXPECT_TRUE(alone.says("goes on after the bag")) << alone;
}

TEST_F(ReplayServersTest, WalkersAreToldApartByTheirTopics) {
  Session one(kId, {}, "/one/");
  Session two("Walker2d-v4", {}, "/two/");
  for (Session* session : {&one, &two}) {
    session->reset(1);
    session->walk(5);
  }
  falsify(two.transition(1, 2).observation[1]);
  {
    rosbag::Bag bag(path(), rosbag::bagmode::Write);
    one.write(bag);
    two.write(bag);
  }
  const Outcome outcome = replay_bags({path()});
  EXPECT_FALSE(outcome.is_equal) << outcome;
  EXPECT_TRUE(outcome.says("/one/transition: BipedalWalker-v3 on Box2D")) << outcome;
  EXPECT_TRUE(outcome.says("\n/two/transition: Walker2d-v4 on MuJoCo")) << outcome;
  EXPECT_TRUE(outcome.says("\n1 episode equal to the bit (5 steps), 1 differing\n")) << outcome;
}

TEST_F(ReplayServersTest, WalkersAreToldApartByTheirNodes) {
  // As walker.launch records: each walker in its namespace, with relative topic names.
  const std::map<std::string, std::string> ids = {{"one", kId}, {"two", "Walker2d-v4"}};
  for (const auto& [space, id] : ids) {
    Session session(id, {}, "");
    session.reset(1);
    session.walk(5);
    rosbag::Bag bag(path(space + ".bag"), rosbag::bagmode::Write);
    session.write(bag, "/" + space + "/walker_sim");
  }
  const Outcome outcome = replay_bags({path("one.bag"), path("two.bag")});
  EXPECT_TRUE(outcome.is_equal) << outcome;
  EXPECT_TRUE(outcome.says("transition of /one/walker_sim: BipedalWalker-v3")) << outcome;
  EXPECT_TRUE(outcome.says("\ntransition of /two/walker_sim: Walker2d-v4")) << outcome;
  EXPECT_TRUE(outcome.says("\n2 episodes equal to the bit (10 steps)\n")) << outcome;
}

}  // namespace
}  // namespace walker::test
