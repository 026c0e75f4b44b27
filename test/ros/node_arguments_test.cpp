// Valid and invalid command lines of a node, and the output of --help.
#include "ros/node_arguments.h"

#include <gtest/gtest.h>

#include <stdexcept>

#include "error_message.h"

namespace walker {
namespace {

const NodeDescription kNode{"server",
                            "walker_sim",
                            "Steps walkers.",
                            {{"env", std::string("BipedalWalker-v3"), "", "Id.", 0, 0},
                             {"command_timeout", 0.5, "s", "Age.", 0, 1},
                             {"mode", std::string("free"), "", "Who steps.", 0, 0}},
                            {"hardcore"}};

std::string refusal(const std::vector<std::string>& arguments) {
  return message_of<std::invalid_argument>([&] { check_arguments(arguments, kNode); });
}

TEST(NodeArguments, AcceptWhatRosAccepts) {
  const std::vector<std::string> accepted{"_env:=Walker2d-v5",
                                          "_anything:=a b",
                                          "__name:=walker_1",
                                          "__ns:=/robot_1",
                                          "__log:=/a-b/c.log",
                                          "effort_command:=/robot/command",
                                          "~step:=/step",
                                          "/gazebo/reset_world:=reset_world",
                                          "other:="};
  EXPECT_NO_THROW(check_arguments(accepted, kNode));
  EXPECT_NO_THROW(check_arguments({}, kNode));
}

TEST(NodeArguments, RejectWordsWithASuggestion) {
  for (const char* word :
       {"_env=Hopper-v5", "env=Hopper-v5", "--env=Hopper-v5", "~env=Hopper-v5"}) {
    EXPECT_EQ(refusal({word}), std::string("argument ") + word +
                                   ": must be _PARAMETER:=VALUE or NAME:=NAME; did you mean "
                                   "_env:=Hopper-v5?");
  }
  EXPECT_NE(refusal({"--hardcore"}).find("did you mean _hardcore:=VALUE?"), std::string::npos);
  EXPECT_NE(refusal({"hard_core=true"}).find("_hardcore:=true?"), std::string::npos);
  EXPECT_NE(refusal({"--command-timeout=1"}).find("_command_timeout:=1?"), std::string::npos);
  EXPECT_NE(refusal({"name=w"}).find("__name:=w?"), std::string::npos);
  for (const char* word : {"", "-", "Walker2d-v5", "--verbose=yes"}) {
    EXPECT_EQ(refusal({word}), std::string("argument ") + word +
                                   ": must be _PARAMETER:=VALUE or NAME:=NAME; see --help");
  }
}

TEST(NodeArguments, RejectRemappedParameters) {
  for (const char* name : {"env", "~env", "/env"}) {
    for (const char* value : {"Walker2d-v5", "hopper", ""}) {
      EXPECT_NE(refusal({std::string(name) + ":=" + value})
                    .find(std::string("did you mean _env:=") + value + "?"),
                std::string::npos);
    }
  }
  EXPECT_NE(refusal({"hardcore:=true"}).find("_hardcore:=true?"), std::string::npos);
  EXPECT_NE(refusal({"ns:=robot-1"}).find("__ns:=robot-1?"), std::string::npos);
}

TEST(NodeArguments, AcceptRemappingsOfALaunchFile) {
  EXPECT_NO_THROW(check_arguments({"mode:=drive/mode", "__name:=w", "__log:=/w.log"}, kNode));
  EXPECT_NE(refusal({"env:=Walker2d-v5", "__log:=/w.log"}).find("_env:=Walker2d-v5?"),
            std::string::npos);
}

TEST(NodeArguments, RejectInvalidNames) {
  for (const char* argument :
       {"__name:=walker-1", "__name:=", "__ns:=robot 1", "scan:=a-b", "1scan:=laser", "a b:=c"}) {
    EXPECT_NE(
        refusal({argument}).find(std::string("argument ") + argument + ": is not a valid name: "),
        std::string::npos)
        << refusal({argument});
  }
}

TEST(NodeArguments, HelpNamesTheProgramAndEachParameter) {
  const std::string text = help_text(kNode);
  EXPECT_EQ(text.rfind("Usage: rosrun walker_sim server [_PARAMETER:=VALUE ...]", 0), 0U) << text;
  for (const char* part : {"\nSteps walkers.\n", "  _env:=BipedalWalker-v3\n      Id.\n",
                           "  _command_timeout:=0.5 [s]\n      Age.\n", " hardcore\n", "docs/"}) {
    EXPECT_NE(text.find(part), std::string::npos) << part << text;
  }
  EXPECT_EQ(text.back(), '\n');
}

}  // namespace
}  // namespace walker
