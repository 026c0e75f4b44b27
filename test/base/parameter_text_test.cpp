// Parses environment parameters from a command line.
#include "base/parameter_text.h"

#include <gtest/gtest.h>

#include <limits>
#include <stdexcept>
#include <string>

#include "error_message.h"

namespace walker {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

const std::vector<ParameterDescription> kDescriptions{
    {"flag", false, "", "", 0, 0},
    {"count", std::int64_t{4}, "", "", 0, 1000},
    {"weight", 1.0, "", "", -kInfinity, kInfinity},
    {"file", std::string("model.xml"), "", "", 0, 0},
    {"range", std::vector<double>{0.8, 2.0}, "", "", -kInfinity, kInfinity},
};

ParameterValue parse_one(const std::string& name, const std::string& text) {
  return parse_assignments(kDescriptions, {name + "=" + text}).at(name);
}

TEST(ParameterText, HasTheTypeOfTheDefault) {
  EXPECT_EQ(parse_one("flag", "true"), ParameterValue(true));
  EXPECT_EQ(parse_one("flag", "false"), ParameterValue(false));
  EXPECT_EQ(parse_one("count", "-12"), ParameterValue(std::int64_t{-12}));
  EXPECT_EQ(parse_one("weight", "2"), ParameterValue(2.0));
  EXPECT_EQ(parse_one("weight", "1e-3"), ParameterValue(1e-3));
  EXPECT_EQ(parse_one("weight", "-.inf"), ParameterValue(-kInfinity));
  EXPECT_EQ(parse_one("file", "/a b=c.xml"), ParameterValue(std::string("/a b=c.xml")));
  EXPECT_EQ(parse_one("file", "12"), ParameterValue(std::string("12")));
  EXPECT_EQ(parse_one("file", ""), ParameterValue(std::string()));
  EXPECT_EQ(parse_one("range", "[0.5, .inf]"), ParameterValue(std::vector<double>{0.5, kInfinity}));
  EXPECT_EQ(parse_one("range", "[-.inf , 2]"), ParameterValue(std::vector<double>{-kInfinity, 2}));
}

TEST(ParameterText, MayHoldSeveralAssignments) {
  EXPECT_TRUE(parse_assignments(kDescriptions, {}).empty());
  EXPECT_EQ(parse_assignments(kDescriptions, {"count=1", "flag=true"}).size(), 2U);
}

/// Unparsable text gets the same error message as any other invalid value.
TEST(ParameterText, RejectsUnparsableValues) {
  const auto message = [](const std::string& assignment) {
    return message_of<std::invalid_argument>([&] {
      complete_parameters(kDescriptions, parse_assignments(kDescriptions, {assignment}));
    });
  };
  EXPECT_EQ(message("flag=yes"), "parameter flag = yes: must be true or false");
  EXPECT_EQ(message("count=four"), "parameter count = four: must be an integer");
  EXPECT_EQ(message("count="), "parameter count = : must be an integer");
  EXPECT_EQ(message("count=99999999999999999999"),
            "parameter count = 99999999999999999999: must be an integer");
  EXPECT_EQ(message("weight=1kg"), "parameter weight = 1kg: must be a number");
  EXPECT_EQ(message("range=0.8"), "parameter range = 0.8: must be a list of numbers");
  EXPECT_EQ(message("range=[a, 2]"), "parameter range = [a, 2]: must be a list of numbers");
  for (const char* text : {" 7", "7 ", "7,0", "0x", "--7"}) {
    EXPECT_EQ(message(std::string("count=") + text),
              std::string("parameter count = ") + text + ": must be an integer");
    EXPECT_EQ(message(std::string("weight=") + text),
              std::string("parameter weight = ") + text + ": must be a number");
  }
  EXPECT_EQ(message("weight=1e999"), "parameter weight = 1e999: must be a number");
  EXPECT_EQ(message("range=[1e999, 2]"), "parameter range = [1e999, 2]: must be a list of numbers");
  const std::string unknown = message("cuont=4");
  EXPECT_EQ(unknown.find("parameter cuont = 4: unknown; did you mean count?"), 0U) << unknown;
}

/// C string functions would stop at the NUL byte.
TEST(ParameterText, ReadsBeyondZeroBytes) {
  using std::string_literals::operator""s;
  EXPECT_EQ(parse_one("flag", "true\0junk"s), ParameterValue("true\0junk"s));
  EXPECT_EQ(parse_one("count", "7\0junk"s), ParameterValue("7\0junk"s));
  EXPECT_EQ(parse_one("count", "7\0"s), ParameterValue("7\0"s));
  EXPECT_EQ(parse_one("weight", "7\0junk"s), ParameterValue("7\0junk"s));
  EXPECT_EQ(parse_one("weight", "\0"s), ParameterValue("\0"s));
  EXPECT_EQ(parse_one("weight", ".inf\0"s), ParameterValue(".inf\0"s));
  EXPECT_EQ(parse_one("range", "[1, 2\0junk]"s), ParameterValue("[1, 2\0junk]"s));
}

TEST(ParameterText, RejectsTextsWithoutAssignment) {
  const auto message = [](const std::vector<std::string>& assignments) {
    return message_of<std::invalid_argument>(
        [&] { parse_assignments(kDescriptions, assignments); });
  };
  EXPECT_EQ(message({"count"}), "count: must be NAME=VALUE");
  EXPECT_EQ(message({"=4"}), "=4: must be NAME=VALUE");
  EXPECT_EQ(message({"count=4", "count=5"}), "parameter count: given twice");
}

}  // namespace
}  // namespace walker
