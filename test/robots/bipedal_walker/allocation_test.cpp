// Stepping, sensing and acting allocate nothing by operator new; Box2D allocates by malloc.
#include <gtest/gtest.h>

#include "allocation_counter.h"
#include "robots/bipedal_walker/player.h"

namespace walker::bipedal_walker {
namespace {

TEST_F(AllocationTest, StepsSensesAndActsWithoutTheHeap) {
  for (const char* id : {"BipedalWalker-v3", "BipedalWalkerHardcore-v3"}) {
    Stepper walker(id);
    Sensors sensors;
    int steps = 0;
    for (std::uint64_t seed = 0; steps < 1000; ++seed) {
      walker.reset(seed);
      walker.environment->sense(sensors);  // sizes the vectors
      Heuristic heuristic;
      std::array<double, kJointCount> action{};
      const Counting counting;
      for (; !walker.has_ended(); ++steps) {
        heuristic.act(walker.observation.data(), action.data());
        walker.environment->step(action.data(), action.size(), walker.result);
        walker.environment->sense(sensors);
      }
    }
    EXPECT_EQ(allocations, 0) << id << " in " << steps << " steps";
  }
}

}  // namespace
}  // namespace walker::bipedal_walker
