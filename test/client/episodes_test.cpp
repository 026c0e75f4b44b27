// Two clients of a real server, and step_many, which Python does not call. test/promises compares
// the client's other calls with the core, lockstep_test.py ~step_many with ~step.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <ros/node_handle.h>
#include <ros/service_client.h>

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

TEST(SharedEpisode, IsSteppedByRoscppAndRepeatedly) {
  const std::unique_ptr<Client> ours = connect("/walker_sim");
  Twin twin("BipedalWalker-v3");
  Transition received;
  twin.reset(5);
  ours->reset(5, received);
  ros::NodeHandle node;
  walker_sim::Step call;
  call.request.action = {0.1, -0.3, 0.7, 0};  // not in single precision
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
  RepeatedStep repeated;
  const double before = twin.episode_return();
  for (int i = 0; i < 7; ++i) twin.step(call.request.action);
  ours->step_many(call.request.action.data(), call.request.action.size(), 7, repeated);
  EXPECT_TRUE(twin.equals(repeated.transition));
  EXPECT_EQ(repeated.steps, 7U);
  EXPECT_NEAR(repeated.total_reward, twin.episode_return() - before, 1e-9);
}

}  // namespace
}  // namespace walker::test
