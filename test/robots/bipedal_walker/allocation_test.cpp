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

TEST_F(AllocationTest, EachCallFillsTheBuffersItIsGiven) {
  Stepper walker("BipedalWalker-v3");
  Stepper twin("BipedalWalker-v3");
  walker.reset(1);
  twin.reset(1);
  const std::vector<double> old = walker.observation;
  std::vector<double> elsewhere(kObservationSize, -7);
  walker.result.observation = elsewhere.data();
  walker.step({1, 0, -1, 0});
  twin.step({1, 0, -1, 0});
  EXPECT_EQ(elsewhere, twin.observation);
  EXPECT_EQ(walker.observation, old);
}

}  // namespace
}  // namespace walker::bipedal_walker
