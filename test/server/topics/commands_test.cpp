#include "server/topics/commands.h"

#include <gtest/gtest.h>

#include <cctype>

namespace walker {
namespace {

/// Letters are callers in order, in upper case if `record` reports a return; '|' is a new episode.
TEST(SteppingAgentsTest, ReportsAnAgentThatReturnsAfterAnother) {
  for (const std::string calls : {"aaa", "abbAaB", "abcd", "a|b|a"}) {
    SteppingAgents agents;
    for (const char call : calls) {
      if (call == '|') {
        agents.clear();
      } else {
        const std::string name(1, static_cast<char>(std::tolower(call)));
        EXPECT_EQ(agents.record(name), std::isupper(call) != 0) << calls;
      }
    }
  }
}

TEST(SteppingAgentsTest, NamesThePreviousAgent) {
  SteppingAgents agents;
  agents.record("/a");
  EXPECT_EQ(agents.other(), "");
  agents.record("/b");
  EXPECT_EQ(agents.other(), "/a");
}

}  // namespace
}  // namespace walker
