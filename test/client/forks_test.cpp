// A client in a forked child.
#include "base/forks.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <functional>
#include <string>

#include "client/scripted_server.h"
#include "client/scripted_walker.h"
#include "error_message.h"

namespace walker {
namespace {

bool in_child(const std::function<bool()>& is_so) {
  const pid_t child = fork();
  if (child == 0) _exit(is_so() ? 0 : 1);
  int status = 0;
  EXPECT_EQ(waitpid(child, &status, 0), child);
  return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

TEST(Forks, AreCountedInTheChild) {
  const unsigned before = num_forks();
  EXPECT_TRUE(in_child([&] { return num_forks() == before + 1; }));
  EXPECT_EQ(num_forks(), before);
}

TEST(Forks, TheChildsCallsAreRefusedAndTheParentsGoOn) {
  const std::string good = test::answer(test::to_bytes(test::example_transition()));
  test::ScriptedWalker walker({test::answering(kStep, {good, good})});
  walker.step();
  EXPECT_TRUE(in_child([&] {
    return message_of<ConnectionError>([&] { walker.step(); }) == kForked &&
           message_of<ConnectionError>([&] { walker.client().specification(); }) == kForked;
  }));
  walker.step();
  EXPECT_EQ(walker.transition.step, 9U);
}

}  // namespace
}  // namespace walker
