#include "walker_sim/parameters.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

#include "error_message.h"

namespace walker {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

const std::vector<ParameterDescription>& descriptions() {
  static const std::vector<ParameterDescription> kDescriptions{
      {"flag", false, "", "A flag.", 0, 0},
      {"count", std::int64_t{7}, "", "An integer.", 1, 10},
      {"weight", 0.5, "kg", "A number.", 0, 2},
      {"file", std::string("a.xml"), "", "A text.", 0, 0},
      {"range", std::vector<double>{-1, 1}, "m", "A list.", -5, 5}};
  return kDescriptions;
}

Parameters complete(const Parameters& given) { return complete_parameters(descriptions(), given); }

std::string refusal(const std::string& name, const ParameterValue& value) {
  return message_of<std::invalid_argument>([&] { complete({{name, value}}); });
}

TEST(Parameters, AreCompletedByDefaults) {
  const Parameters completed = complete({{"count", std::int64_t{3}}});
  ASSERT_EQ(completed.size(), 5U);
  EXPECT_EQ(completed.at("count"), ParameterValue(std::int64_t{3}));
  for (const ParameterDescription& description : descriptions()) {
    if (description.name == "count") continue;
    EXPECT_EQ(completed.at(description.name), description.default_value) << description.name;
  }
}

TEST(Parameters, ConvertExactNumbers) {
  EXPECT_EQ(complete({{"count", 3.0}}).at("count"), ParameterValue(std::int64_t{3}));
  EXPECT_EQ(complete({{"weight", std::int64_t{2}}}).at("weight"), ParameterValue(2.0));
}

TEST(Parameters, IncludeTheirLimits) {
  EXPECT_NO_THROW(complete({{"count", std::int64_t{1}}}));
  EXPECT_NO_THROW(complete({{"count", std::int64_t{10}}}));
  EXPECT_NO_THROW(complete({{"weight", 0.0}}));
  EXPECT_NO_THROW(complete({{"weight", 2.0}}));
  EXPECT_NO_THROW(complete({{"range", std::vector<double>{-5, 5}}}));
}

TEST(Parameters, RejectOtherTypesAndValues) {
  EXPECT_EQ(refusal("flag", std::int64_t{1}), "parameter flag = 1: must be true or false");
  EXPECT_EQ(refusal("flag", std::string("yes")), "parameter flag = yes: must be true or false");
  EXPECT_EQ(refusal("count", std::int64_t{0}),
            "parameter count = 0: must be an integer in [1, 10]");
  EXPECT_EQ(refusal("count", std::int64_t{11}),
            "parameter count = 11: must be an integer in [1, 10]");
  EXPECT_EQ(refusal("count", 2.5), "parameter count = 2.5: must be an integer in [1, 10]");
  EXPECT_EQ(refusal("count", true), "parameter count = true: must be an integer");
  EXPECT_EQ(refusal("count", 1e300), "parameter count = 1.0e+300: must be an integer in [1, 10]");
  EXPECT_EQ(refusal("count", -1e300), "parameter count = -1.0e+300: must be an integer in [1, 10]");
  EXPECT_EQ(refusal("count", kInfinity), "parameter count = .inf: must be an integer in [1, 10]");
  EXPECT_EQ(refusal("count", -1.0), "parameter count = -1: must be an integer in [1, 10]");
  EXPECT_EQ(refusal("count", kNan), "parameter count = .nan: must be an integer in [1, 10]");
  EXPECT_EQ(refusal("weight", 2.5), "parameter weight = 2.5: must be a number in [0.0, 2.0]");
  EXPECT_EQ(refusal("weight", -kInfinity),
            "parameter weight = -.inf: must be a number in [0.0, 2.0]");
  EXPECT_EQ(refusal("weight", kNan), "parameter weight = .nan: must be a number in [0.0, 2.0]");
  EXPECT_EQ(refusal("weight", std::string("2")), "parameter weight = 2: must be a number");
  EXPECT_EQ(refusal("file", 1.0), "parameter file = 1.0: must be a text");
  EXPECT_EQ(refusal("range", 1.0), "parameter range = 1.0: must be a list of numbers");
  EXPECT_EQ(refusal("range", std::vector<double>{1}),
            "parameter range = [1.0]: must be a list of 2 numbers");
  EXPECT_EQ(refusal("range", std::vector<double>{0, 6}),
            "parameter range = [0.0, 6.0]: must be a list of numbers in [-5.0, 5.0]");
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

TEST(Parameters, TextOfDoublesKeepsEveryBit) {
  for (const double value :
       {0.1 + 0.2, 1e23, 123456789.123456789, -2.2250738585072014e-308, 1e22}) {
    EXPECT_EQ(std::stod(to_string(value)), value);
  }
}

}  // namespace
}  // namespace walker
