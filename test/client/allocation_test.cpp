// After the first steps, a step allocates nothing.
#include <gtest/gtest.h>

#include "allocation_counter.h"
#include "client/scripted_server.h"
#include "client/scripted_walker.h"

namespace walker {
namespace {

constexpr int kSteps = 100;

TEST_F(AllocationTest, TheClientStepsWithoutTheHeap) {
  test::ScriptedWalker walker({[](test::Peer& peer) {
    test::open(peer, kStep);
    const std::string answer = test::answer(test::to_bytes(test::example_transition()));
    // All requests have one size. This thread must not allocate: the counter covers it too.
    std::string request(4 + 4 + sizeof(double), '\0');
    while (peer.take(request)) peer.give(answer);
  }});
  walker.step();
  walker.step();
  {
    const Counting counting;
    for (int i = 0; i < kSteps; ++i) walker.step();
  }
  EXPECT_EQ(allocations, 0);
}

}  // namespace
}  // namespace walker
