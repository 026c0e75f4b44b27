#include "walker_sim/parameters.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <tuple>

#include "base/parameter_text.h"
#include "error_message.h"

namespace walker {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

const std::vector<ParameterDescription> kDescriptions{
    {"flag", false, "", "A flag.", 0, 0},
    {"count", std::int64_t{7}, "", "An integer.", 1, 10},
    {"weight", 0.5, "kg", "A number.", 0, 2},
    {"file", std::string("a.xml"), "", "A text.", 0, 0},
    {"range", std::vector<double>{-1, 1}, "m", "A list.", -5, 5}};

Parameters complete(const Parameters& given) { return complete_parameters(kDescriptions, given); }

std::string refusal(const std::string& name, const ParameterValue& value) {
  return message_of<std::invalid_argument>([&] { complete({{name, value}}); });
}

TEST(Parameters, AreCompletedByDefaults) {
  const Parameters completed = complete({{"count", std::int64_t{3}}});
  ASSERT_EQ(completed.size(), 5U);
  EXPECT_EQ(completed.at("count"), ParameterValue(std::int64_t{3}));
  for (const ParameterDescription& description : kDescriptions) {
    if (description.name == "count") continue;
    EXPECT_EQ(completed.at(description.name), description.default_value) << description.name;
  }
}

TEST(Parameters, ConvertExactNumbers) {
  EXPECT_EQ(complete({{"count", 3.0}}).at("count"), ParameterValue(std::int64_t{3}));
  EXPECT_EQ(complete({{"weight", std::int64_t{2}}}).at("weight"), ParameterValue(2.0));
}

TEST(Parameters, IncludeTheirLimits) {
  EXPECT_NO_THROW(complete({{"count", std::int64_t{1}}, {"weight", 0.0}}));
  EXPECT_NO_THROW(complete({{"count", std::int64_t{10}}, {"weight", 2.0}}));
  EXPECT_NO_THROW(complete({{"range", std::vector<double>{-5, 5}}}));
}

TEST(Parameters, RejectOtherTypesAndValues) {
  using List = std::vector<double>;
  const std::tuple<std::string, ParameterValue, std::string> cases[] = {
      {"flag", std::int64_t{1}, "1: must be true or false"},
      {"flag", std::string("yes"), "yes: must be true or false"},
      {"count", std::int64_t{0}, "0: must be an integer in [1, 10]"},
      {"count", std::int64_t{11}, "11: must be an integer in [1, 10]"},
      {"count", 2.5, "2.5: must be an integer in [1, 10]"},
      {"count", true, "true: must be an integer"},
      {"count", 1e300, "1.0e+300: must be an integer in [1, 10]"},
      {"count", -1e300, "-1.0e+300: must be an integer in [1, 10]"},
      {"count", kInfinity, ".inf: must be an integer in [1, 10]"},
      {"count", -1.0, "-1: must be an integer in [1, 10]"},
      {"count", kNan, ".nan: must be an integer in [1, 10]"},
      {"weight", 2.5, "2.5: must be a number in [0.0, 2.0]"},
      {"weight", -kInfinity, "-.inf: must be a number in [0.0, 2.0]"},
      {"weight", kNan, ".nan: must be a number in [0.0, 2.0]"},
      {"weight", std::string("2"), "2: must be a number"},
      {"file", 1.0, "1.0: must be a text"},
      {"range", 1.0, "1.0: must be a list of numbers"},
      {"range", List{1}, "[1.0]: must be a list of 2 numbers"},
      {"range", List{0, 6}, "[0.0, 6.0]: must be a list of numbers in [-5.0, 5.0]"},
  };
  for (const auto& [name, value, reason] : cases) {
    std::string expected = "parameter " + name;
    expected.append(" = ").append(reason);
    EXPECT_EQ(refusal(name, value), expected);
  }
}

/// An error message is a C string of one line.
TEST(Parameters, AreEscapedAndTruncatedInMessages) {
  using std::string_literals::operator""s;
  EXPECT_EQ(refusal("count", "7\0junk\n"s), "parameter count = 7\\x00junk\\n: must be an integer");
  const std::string half(500, 'x');
  EXPECT_EQ(refusal("count", std::string(1000000, 'x')), "parameter count = " + half +
                                                             " [... 999000 bytes left out ...] " +
                                                             half + ": must be an integer");
  EXPECT_LT(refusal(std::string(1000000, 'x'), 1.0).size(), 1200U);
}

TEST(Parameters, SuggestAKnownName) {
  EXPECT_EQ(refusal("wieght", 1.0),
            "parameter wieght = 1.0: unknown; did you mean weight? "
            "Known: flag count weight file range");
  EXPECT_EQ(refusal("gravity", 1.0),
            "parameter gravity = 1.0: unknown. Known: flag count weight file range");
}

TEST(Parameters, NearestName) {
  const std::vector<std::string> known{"hardcore", "reuse_world"};
  EXPECT_EQ(nearest_name("hardcor", known), "hardcore");
  EXPECT_EQ(nearest_name("Hardcore", known), "hardcore");
  EXPECT_EQ(nearest_name("resue_world", known), "reuse_world");
  EXPECT_EQ(nearest_name("seed", known), "");
  EXPECT_EQ(nearest_name("", known), "");
}

TEST(Parameters, TextReadsBackInYaml) {
  EXPECT_EQ(to_string(true), "true");
  EXPECT_EQ(to_string(std::int64_t{-3}), "-3");
  EXPECT_EQ(to_string(1600.0), "1600.0");
  EXPECT_EQ(to_string(0.1), "0.1");
  EXPECT_EQ(to_string(1.0 / 3.0), "0.3333333333333333");
  EXPECT_EQ(to_string(-0.0), "-0.0");
  EXPECT_EQ(to_string(1e15), "1.0e+15") << "YAML 1.1 takes 1e+15 for a text";
  EXPECT_EQ(to_string(1e-5), "1.0e-05");
  EXPECT_EQ(to_string(kInfinity), ".inf");
  EXPECT_EQ(to_string(kNan), ".nan");
  EXPECT_EQ(to_string(std::vector<double>{}), "[]");
  EXPECT_EQ(to_string(std::vector<double>{0.5, 2}), "[0.5, 2.0]");
}

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
  const std::tuple<std::string, std::string, std::vector<std::string>> cases[] = {
      {"flag", "true or false", {"yes"}},
      {"count", "an integer", {"four", "", "99999999999999999999", " 7", "7 ", "7,0", "0x", "--7"}},
      {"weight", "a number", {"1kg", "1e999", " 7", "7 ", "7,0", "0x", "--7"}},
      {"range", "a list of numbers", {"0.8", "[a, 2]", "[1e999, 2]"}},
  };
  for (const auto& [name, type, texts] : cases) {
    for (const std::string& text : texts) {
      std::string given = name;
      given.append("=").append(text);
      std::string expected = "parameter " + name;
      expected.append(" = ").append(text).append(": must be ").append(type);
      EXPECT_EQ(message(given), expected);
    }
  }
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
