// The agent nodes walk like heuristic and policy in process: bit by bit over ~step, and over topics
// as closely as two asynchronous processes can.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <nav_msgs/Odometry.h>
#include <ros/ros.h>

#include "agents/robot.h"
#include "robots/bipedal_walker/heuristic.h"
#include "walker_sim/Episode.h"
#include "walker_sim/Transition.h"

namespace walker::test {
namespace {

const std::vector<std::uint64_t> kSeeds{0, 3, 6};  // as in heuristic_agents_test.test

void expect_equal_episodes(const std::string& name_space, const std::string& id,
                           const std::string& agent) {
  ros::NodeHandle node;
  Inbox<walker_sim::Episode> episodes(node, name_space + "/episode");
  // Covers each seed once, and one episode more, from the agent's present episode.
  ASSERT_TRUE(episodes.find([first = std::uint32_t{0}](const walker_sim::Episode& message) mutable {
    if (first == 0) first = message.episode;
    return message.episode >= first + kSeeds.size() + 1 && message.length > 0;
  }));
  std::map<std::uint64_t, int> ends;
  for (const walker_sim::Episode& told : episodes.messages()) {
    EXPECT_TRUE(told.has_seed);
    EXPECT_EQ(told.seed, kSeeds[(told.episode - 1) % kSeeds.size()]) << "not the next in turn";
    if (told.length == 0) continue;
    ++ends[told.seed];
    Twin twin(id);
    const auto mind = make_node_agent(agent, twin.environment().specification());
    twin.reset(told.seed);
    std::uint32_t length = 0;
    for (; !twin.has_ended(); ++length) twin.step(mind->act(twin.observation()));
    EXPECT_EQ(told.length, length) << "seed " << told.seed;
    EXPECT_EQ(bits({told.episode_return}), bits({twin.episode_return()})) << "seed " << told.seed;
    EXPECT_NE(told.end_reason.find(twin.end_reason()), std::string::npos) << told.end_reason;
  }
  for (const std::uint64_t seed : kSeeds) EXPECT_GT(ends[seed], 0) << "seed " << seed;
}

TEST(ServiceAgent, PlaysHeuristicsAndTheShippedPolicyToTheBit) {
  expect_equal_episodes("/lockstep", "BipedalWalker-v3", "heuristic");
  expect_equal_episodes("/lockstep_walker2d", "Walker2d-v5", "heuristic");
  expect_equal_episodes("/lockstep_policy", "BipedalWalker-v3", "policy");
}

TEST(ServiceAgent, WithoutSeedsTheGeneratorContinues) {
  ros::NodeHandle node;
  Inbox<walker_sim::Episode> episodes(node, "/random/episode");
  Inbox<walker_sim::Transition> transitions(node, "/random/transition");
  ASSERT_TRUE(
      episodes.find([](const walker_sim::Episode& message) { return message.episode > 5; }));
  for (const walker_sim::Episode& told : episodes.messages()) {
    EXPECT_EQ(told.has_seed != 0, told.episode == 1) << "episode " << told.episode;
  }
  // A latched ~episode may be older than the first transition received.
  ASSERT_TRUE(transitions.find(
      [count = 0](const walker_sim::Transition& /*message*/) mutable { return ++count == 100; }));
  std::size_t different = 0;
  std::vector<double> last;
  for (const walker_sim::Transition& told : transitions.messages()) {
    for (const double value : told.action) {
      EXPECT_EQ(value, double{static_cast<float>(value)}) << "not the random agent's";
    }
    different += told.action != last ? 1 : 0;
    last = told.action;
  }
  EXPECT_GT(different, transitions.messages().size() / 2) << "random is not random";
}

/// The agent builds its observation from the sensors, within 1.2e-7 of the transition's; the
/// heuristic's gain is at most 15.
bool are_close(const std::vector<double>& action, const std::vector<double>& other) {
  constexpr double kBound = 1e-5;
  return std::equal(action.begin(), action.end(), other.begin(), other.end(),
                    [](double a, double b) { return std::abs(a - b) < kBound; });
}

/// Server and agent are separate processes: a command may arrive one step late, rarely two.
TEST(TopicAgent, AnswersEachTransitionWithTheHeuristicsAction) {
  ros::NodeHandle node;
  Inbox<walker_sim::Transition> transitions(node, "/topics/transition");
  const auto begun =
      transitions.find([](const walker_sim::Transition& message) { return message.step == 0; });
  ASSERT_TRUE(begun) << "no episode begins";
  const std::uint32_t episode = begun->episode;
  ASSERT_TRUE(transitions.find([&](const walker_sim::Transition& message) {
    return message.episode == episode && (message.step == 150 || message.terminated);
  }));
  bipedal_walker::Heuristic heuristic;
  std::vector<std::vector<double>> answers;
  int in_time = 0;
  int late = 0;
  int steps = 0;
  for (const walker_sim::Transition& told : transitions.messages()) {
    if (told.episode != episode || told.step > 150) continue;
    ASSERT_EQ(told.step, answers.size()) << "a transition was lost";
    if (told.step > 0) {
      ++steps;
      if (are_close(told.action, answers.back())) {
        ++in_time;
      } else if (told.step > 1 && are_close(told.action, answers[told.step - 2])) {
        ++late;
      }
    }
    answers.emplace_back(4);
    heuristic.act(told.observation.data(), answers.back().data());
  }
  EXPECT_GT(steps, 30);
  EXPECT_GT(in_time + late, steps * 3 / 4) << in_time << " in time, " << late << " late";
  EXPECT_GT(in_time, steps / 2) << in_time << " in time, " << late << " late";
}

TEST(TopicAgent, WalksFurtherThanAnyFall) {
  ros::NodeHandle node;
  Inbox<nav_msgs::Odometry> odometries(node, "/topics/odom");
  const auto far = odometries.find([](const nav_msgs::Odometry& message) {
    return message.pose.pose.position.x > 9;  // it starts near 4.7 m
  });
  EXPECT_TRUE(far);
}

}  // namespace
}  // namespace walker::test
