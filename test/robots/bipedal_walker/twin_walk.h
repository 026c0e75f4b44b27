// A walk of a walker and its twin, with the walker's sensors.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "robots/bipedal_walker/player.h"
#include "robots/bipedal_walker/twin.h"
#include "stepper.h"

namespace walker::bipedal_walker {

class TwinWalk : public testing::Test {
 protected:
  static constexpr std::uint64_t kSeed = 3;

  void SetUp() override { walker_.reset(kSeed); }

  /// Calls `check` after the reset and after each of up to `num_steps` steps.
  template <typename Check>
  void walk(Check check, int num_steps = 300) {
    Actions actions("heuristic", 0);
    std::vector<double> action(kJointCount, 0);
    walker_.environment->sense(sensors_);
    check(action);
    for (step_ = 1; step_ <= num_steps && !walker_.has_ended(); ++step_) {
      SCOPED_TRACE("step " + std::to_string(step_));
      actions.draw(walker_.observation, action);
      walker_.step(action);
      twin_.step(action.data());
      walker_.environment->sense(sensors_);
      check(action);
    }
    EXPECT_GT(step_, std::min(num_steps, 100));
  }

  const b2Body& hull() const { return twin_.physics().hull(); }
  const Specification& specification() const { return walker_.environment->specification(); }

  Stepper walker_{"BipedalWalker-v3"};
  Twin twin_{kSeed};
  Sensors sensors_;
  int step_ = 0;
};

}  // namespace walker::bipedal_walker
