// The client against real servers: step_many, which Python does not call, and two clients.
// python/bits_ros_test compares its other calls with the core.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

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
std::unique_ptr<Client> connect(const std::string& server) {
  ClientOptions options;
  options.server = server;
  const auto give_up = std::chrono::steady_clock::now() + kMaxWait;
  while (true) {
    try {
      return std::make_unique<Client>(options);
    } catch (const ConnectionError&) {
      if (std::chrono::steady_clock::now() > give_up) throw;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
}

class Episodes : public testing::TestWithParam<std::pair<const char*, const char*>> {};

/// Compares step_many with repeated single steps, up to the episode's end.
TEST_P(Episodes, EqualTheCoresWithRepeatedSteps) {
  const auto& [server, id] = GetParam();
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

INSTANTIATE_TEST_SUITE_P(Servers, Episodes,
                         testing::Values(std::pair{"/walker_sim", "BipedalWalker-v3"},
                                         std::pair{"/v5/walker_sim", "Walker2d-v5"}));

TEST(SharedEpisode, IsSteppedByRoscppToo) {
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
      const std::uint64_t stamp = call.response.transition.header.stamp.toNSec();
      twin.step(call.request.action);
      ours->step(call.request.action.data(), call.request.action.size(), received);
      EXPECT_TRUE(twin.equals(received));
      EXPECT_EQ(received.action, call.request.action);
      EXPECT_EQ(static_cast<std::int64_t>(received.stamp - stamp),
                std::llround(1e9 * twin.environment().specification().dt));
    }
  }
}

}  // namespace
}  // namespace walker::test
