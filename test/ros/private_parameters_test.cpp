// Numeric parameters that are converted to text, and seeds.
#include "ros/private_parameters.h"

#include <gtest/gtest.h>

#include <limits>
#include <stdexcept>

#include "error_message.h"

namespace walker {
namespace {

using List = std::vector<double>;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

ParameterValue as_text(const ParameterValue& value) {
  Parameters parameters{{"seeds", value}};
  take_as_text("seeds", parameters);
  return parameters.at("seeds");
}

TEST(PrivateParameters, ConvertDigitsToText) {
  EXPECT_EQ(as_text(std::int64_t{12}), ParameterValue(std::string("12")));
  EXPECT_EQ(as_text(std::int64_t{-1}), ParameterValue(std::string("-1")));
  EXPECT_EQ(as_text(List{0, 7, -3}), ParameterValue(std::string("0 7 -3")));
  EXPECT_EQ(as_text(List{}), ParameterValue(std::string()));
  EXPECT_EQ(as_text(std::string("5 6")), ParameterValue(std::string("5 6")));
  EXPECT_EQ(as_text(true), ParameterValue(true));  // not a number, so its type is refused later
}

/// The values include the bounds of a 64-bit integer.
TEST(PrivateParameters, KeepNumbersThatAreNotIntegers) {
  EXPECT_EQ(as_text(List{1e300, -1e300, kNan, kInfinity, -kInfinity, 2.5}),
            ParameterValue(std::string("1.0e+300 -1.0e+300 .nan .inf -.inf 2.5")));
  EXPECT_EQ(as_text(List{9223372036854775808.0, 9223372036854774784.0, -9223372036854775808.0}),
            ParameterValue(
                std::string("9.223372036854776e+18 9223372036854774784 -9223372036854775808")));
  EXPECT_EQ(as_text(1e300), ParameterValue(std::string("1.0e+300")));
  EXPECT_EQ(as_text(5.0), ParameterValue(std::string("5.0")));
}

TEST(PrivateParameters, ConvertNumericTexts) {
  const std::vector<ParameterDescription> descriptions{{"factor", 1.0, "", "", 0, 1e9},
                                                       {"count", std::int64_t{1}, "", "", 0, 1e9},
                                                       {"flag", false, "", "", 0, 0},
                                                       {"name", std::string(), "", "", 0, 0},
                                                       {"range", List{0, 1}, "", "", 0, 1}};
  const auto taken = [&](const std::string& name, const std::string& text) {
    Parameters parameters{{name, text}};
    take_numbers(descriptions, parameters);
    return parameters.at(name);
  };
  EXPECT_EQ(taken("factor", "1.0e3"), ParameterValue(1000.0));
  EXPECT_EQ(taken("factor", "1e-3"), ParameterValue(0.001));
  EXPECT_EQ(taken("factor", "-.inf"), ParameterValue(-kInfinity));
  EXPECT_EQ(taken("count", "1.0e3"), ParameterValue(1000.0));
  EXPECT_EQ(taken("count", "7"), ParameterValue(7.0));
  for (const char* text : {"fast", "", " 1", "1 ", "1,5", "1e999", "1.0e3x", "[1]"}) {
    EXPECT_EQ(taken("factor", text), ParameterValue(std::string(text)));
    EXPECT_EQ(taken("count", text), ParameterValue(std::string(text)));
  }
  for (const char* name : {"flag", "name", "range", "unknown"}) {
    EXPECT_EQ(taken(name, "1"), ParameterValue(std::string("1")));
  }
}

TEST(PrivateParameters, RejectInvalidSeeds) {
  EXPECT_EQ(parse_seed("seed", ""), std::nullopt);
  EXPECT_EQ(parse_seed("seed", "18446744073709551615"), std::numeric_limits<std::uint64_t>::max());
  for (const char* text : {"-1", "1.0e+300", ".nan", "5.0", "18446744073709551616", "1 2"}) {
    EXPECT_EQ(message_of<std::invalid_argument>([&] { parse_seed("seed", text); }),
              "parameter seed = " + std::string(text) +
                  ": must be a decimal integer in [0, 18446744073709551615], or empty");
  }
}

}  // namespace
}  // namespace walker
