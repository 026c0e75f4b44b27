// The client against real servers: bit-identical episodes, and two clients.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include <ros/init.h>
#include <ros/node_handle.h>
#include <ros/service_client.h>

#include "error_message.h"
#include "server/twin.h"
#include "walker_sim/Step.h"
#include "walker_sim/client.h"

namespace walker::test {
namespace {

constexpr std::chrono::seconds kMaxWait{60};

/// Retries on ConnectionError: servers need time to start.
template <typename Call>
void until_connected(const Call& call) {
  const auto give_up = std::chrono::steady_clock::now() + kMaxWait;
  while (true) {
    try {
      call();
      return;
    } catch (const ConnectionError&) {
      if (std::chrono::steady_clock::now() > give_up) throw;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
}

std::unique_ptr<Client> connect(const std::string& server) {
  ClientOptions options;
  options.server = server;
  std::unique_ptr<Client> client;
  until_connected([&] { client = std::make_unique<Client>(options); });
  return client;
}

/// Compares every step of an episode. @return the episode's length
std::uint32_t compare_episode(Client& client, Twin& twin, std::optional<std::uint64_t> seed,
                              unsigned draw) {
  std::mt19937 generator(draw);
  std::uniform_real_distribution<float> uniform(-1, 1);
  std::vector<double> action(twin.environment().specification().action_size());
  Transition received;
  twin.reset(seed);
  client.reset(seed, received);
  EXPECT_TRUE(twin.equals(received));
  EXPECT_TRUE(received.action.empty());
  while (!twin.has_ended() && !testing::Test::HasFailure()) {
    for (double& value : action) value = double{uniform(generator)};
    twin.step(action);
    const std::uint64_t stamp = received.stamp;
    client.step(action.data(), action.size(), received);
    EXPECT_TRUE(twin.equals(received));
    EXPECT_EQ(received.action, action);
    EXPECT_EQ(static_cast<std::int64_t>(received.stamp - stamp),
              std::llround(1e9 * twin.environment().specification().dt));
  }
  return received.step;
}

void compare_episodes(const std::string& server, const std::string& id) {
  const std::unique_ptr<Client> client = connect(server);
  const ServerSpecification specification = client->specification();
  Twin twin(id);
  EXPECT_EQ(specification.id, id);
  EXPECT_EQ(specification.num_envs, 1U);
  EXPECT_EQ(bits(specification.action_low), bits(twin.environment().specification().action_low));
  EXPECT_EQ(bits(specification.observation_high),
            bits(twin.environment().specification().observation_high));
  std::uint32_t steps = 0;
  for (unsigned i = 0; i < 8; ++i) {
    const std::optional<std::uint64_t> seed =
        i % 2 == 0 ? std::optional<std::uint64_t>(i) : std::nullopt;
    steps += compare_episode(*client, twin, seed, i);
  }
  EXPECT_GT(steps, 100U);
}

TEST(Episodes, EqualTheCoresForBipedalWalker) {
  compare_episodes("/walker_sim", "BipedalWalker-v3");
}

TEST(Episodes, EqualTheCoresForWalker2d) { compare_episodes("/v5/walker_sim", "Walker2d-v5"); }

/// Compares step_many with repeated single steps, up to the episode's end.
void compare_repeated_steps(const std::string& server, const std::string& id) {
  const std::unique_ptr<Client> client = connect(server);
  Twin twin(id);
  const std::vector<double> action(twin.environment().specification().action_size(), 0.5);
  constexpr std::uint32_t kSteps = 7;
  Transition begun;
  twin.reset(8);
  client->reset(8, begun);
  std::uint32_t calls = 0;
  RepeatedStep repeated;
  while (!twin.has_ended() && !testing::Test::HasFailure()) {
    const double before = twin.episode_return();
    std::uint32_t steps = 0;
    for (; steps < kSteps && !twin.has_ended(); ++steps) twin.step(action);
    client->step_many(action.data(), action.size(), kSteps, repeated);
    EXPECT_TRUE(twin.equals(repeated.transition));
    EXPECT_EQ(repeated.steps, steps);
    EXPECT_NEAR(repeated.total_reward, twin.episode_return() - before, 1e-9);
    ++calls;
  }
  EXPECT_GT(calls, 3U);
  EXPECT_NE(repeated.transition.step % kSteps, 0U) << "it was to end within a call";
  EXPECT_NE(message_of<RequestRefused>([&] {
              client->step_many(action.data(), action.size(), kSteps, repeated);
            }).find("ended"),
            std::string::npos);
}

TEST(Episodes, EqualTheCoresWithRepeatedSteps) {
  compare_repeated_steps("/walker_sim", "BipedalWalker-v3");
  compare_repeated_steps("/v5/walker_sim", "Walker2d-v5");
}

TEST(Episodes, AreSharedWithRoscpp) {
  const std::unique_ptr<Client> ours = connect("/walker_sim");
  Twin twin("BipedalWalker-v3");
  Transition received;
  twin.reset(5);
  ours->reset(5, received);
  ros::NodeHandle node;
  walker_sim::Step call;
  call.request.action = {0.5, -0.5, 0.25, 0};
  for (const bool persistent : {true, false}) {
    ros::ServiceClient theirs =
        node.serviceClient<walker_sim::Step>("/walker_sim/step", persistent);
    EXPECT_TRUE(theirs.waitForExistence(ros::Duration(kMaxWait.count())));
    EXPECT_TRUE(theirs.exists());
    for (int i = 0; i < 5; ++i) {
      twin.step(call.request.action);
      ASSERT_TRUE(theirs.call(call));
      EXPECT_TRUE(twin.equals(call.response.transition));
      twin.step(call.request.action);
      ours->step(call.request.action.data(), call.request.action.size(), received);
      EXPECT_TRUE(twin.equals(received));
    }
  }
}

}  // namespace
}  // namespace walker::test

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "client_episodes_test");
  const ros::NodeHandle node;
  return RUN_ALL_TESTS();
}
