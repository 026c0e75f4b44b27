// Client of a lock-step server's ~reset and ~step services.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <ros/node_handle.h>
#include <ros/service.h>
#include <ros/service_client.h>

#include "server/inbox.h"
#include "server/twin.h"
#include "walker_sim/Reset.h"
#include "walker_sim/Step.h"
#include "walker_sim/Transition.h"

namespace walker::test {

/// Resets and steps over persistent connections; a failed call fails the test.
class Remote {
 public:
  /// @param name of the server's node
  explicit Remote(const std::string& name) {
    wait_until([&] { return ros::service::exists(name + "/step", false); });
    reset_ = node_.serviceClient<walker_sim::Reset>(name + "/reset", true);
    step_ = node_.serviceClient<walker_sim::Step>(name + "/step", true);
  }

  walker_sim::Transition reset(std::optional<std::uint64_t> seed) {
    walker_sim::Reset call;
    call.request.has_seed = seed.has_value() ? 1 : 0;
    call.request.seed = seed.value_or(0);
    EXPECT_TRUE(reset_.call(call));
    EXPECT_TRUE(call.response.success) << call.response.status_message;
    return call.response.transition;
  }

  walker_sim::Transition step(const std::vector<double>& action) {
    walker_sim::Step call;
    call.request.action = action;
    EXPECT_TRUE(step_.call(call));
    EXPECT_TRUE(call.response.success) << call.response.status_message;
    EXPECT_EQ(bits(call.response.transition.action), bits(action));
    return call.response.transition;
  }

 private:
  ros::NodeHandle node_;
  ros::ServiceClient reset_;
  ros::ServiceClient step_;
};

}  // namespace walker::test
