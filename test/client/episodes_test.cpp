// Two clients of a real server, and step_many, which Python does not call. test/promises compares
// the client's other calls with the core, lockstep_test.py ~step_many with ~step.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include <ros/node_handle.h>
#include <ros/service.h>
#include <ros/service_client.h>

#include "server/inbox.h"
#include "server/twin.h"
#include "walker_sim/Step.h"
#include "walker_sim/client.h"

namespace walker::test {
namespace {

TEST(SharedEpisode, IsSteppedByRoscppAndRepeatedly) {
  for (const std::string service : {"get_spec", "reset", "step", "step_many"}) {
    wait_until([&] { return ros::service::exists("/walker_sim/" + service, false); });
  }
  Client ours;
  Twin twin("BipedalWalker-v3");
  Transition received;
  twin.reset(5);
  ours.reset(5, received);
  ros::NodeHandle node;
  walker_sim::Step call;
  call.request.action = {0.1, -0.3, 0.7, 0};  // not in single precision
  for (const bool persistent : {true, false}) {
    ros::ServiceClient theirs =
        node.serviceClient<walker_sim::Step>("/walker_sim/step", persistent);
    EXPECT_TRUE(theirs.waitForExistence());
    EXPECT_TRUE(theirs.exists());
    for (int i = 0; i < 5; ++i) {
      twin.step(call.request.action);
      ASSERT_TRUE(theirs.call(call));
      EXPECT_TRUE(twin.equals(call.response.transition));
      const std::uint64_t stamp = call.response.transition.header.stamp.toNSec();
      twin.step(call.request.action);
      ours.step(call.request.action.data(), call.request.action.size(), received);
      EXPECT_TRUE(twin.equals(received));
      EXPECT_EQ(received.action, call.request.action);
      EXPECT_EQ(static_cast<std::int64_t>(received.stamp - stamp),
                std::llround(1e9 * twin.environment().specification().dt));
    }
  }
  RepeatedStep repeated;
  const double before = twin.episode_return();
  for (int i = 0; i < 7; ++i) twin.step(call.request.action);
  ours.step_many(call.request.action.data(), call.request.action.size(), 7, repeated);
  EXPECT_TRUE(twin.equals(repeated.transition));
  EXPECT_EQ(repeated.steps, 7U);
  EXPECT_NEAR(repeated.total_reward, twin.episode_return() - before, 1e-9);
}

}  // namespace
}  // namespace walker::test
