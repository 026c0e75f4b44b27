#include "server/stepping_agents.h"

#include <gtest/gtest.h>

namespace walker {
namespace {

TEST(SteppingAgentsTest, OneIsNotTwo) {
  SteppingAgents agents;
  for (int step = 0; step < 3; ++step) EXPECT_FALSE(agents.note("/a"));
  EXPECT_EQ(agents.other(), "");
}

TEST(SteppingAgentsTest, WhoComesBackIsOneOfTwo) {
  SteppingAgents agents;
  agents.note("/a");
  EXPECT_FALSE(agents.note("/b"));
  EXPECT_FALSE(agents.note("/b"));
  EXPECT_TRUE(agents.note("/a"));
  EXPECT_EQ(agents.other(), "/b");
  EXPECT_FALSE(agents.note("/a"));
  EXPECT_TRUE(agents.note("/b"));
}

// Each `rosservice call` is a node with a new name.
TEST(SteppingAgentsTest, OneAfterTheOtherAreNotTwo) {
  SteppingAgents agents;
  for (const char* name : {"/rosservice_1", "/rosservice_2", "/rosservice_3"}) {
    EXPECT_FALSE(agents.note(name));
  }
}

TEST(SteppingAgentsTest, AnEpisodeMayBeAnothers) {
  SteppingAgents agents;
  agents.note("/a");
  agents.clear();
  agents.note("/b");
  agents.clear();
  EXPECT_FALSE(agents.note("/a"));
}

}  // namespace
}  // namespace walker
