// Formatting and parsing of numbers do not depend on the locale.
#include "base/shortest_text.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <cstdlib>
#include <optional>
#include <random>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "base/parameter_text.h"
#include "error_message.h"
#include "foreign_locale.h"

namespace walker {
namespace {

const std::vector<ParameterDescription> kDescriptions{
    {"weight", 0.5, "", "", -2e6, 2e6},
    {"count", std::int64_t{4}, "", "", 0, 10000000},
    {"range", std::vector<double>{0.8, 2.0}, "", "", -5, 5},
};

std::vector<std::string> texts() {
  const Parameters parameters =
      parse_assignments(kDescriptions, {"weight=1234567.5", "count=1234567", "range=[0.25, 1e0]"});
  ClassicStream stream;
  stream << 1234567 << ' ' << 1234.5 << ' ' << true;
  return {
      to_string(0.001),
      to_string(1234567.0),
      to_string(std::int64_t{1234567}),
      to_string(std::vector<double>{0.8, 1e-300}),
      to_string(parameters.at("weight")),
      to_string(parameters.at("count")),
      to_string(parameters.at("range")),
      shortest_text(0.1F),
      fixed_text(1234567.25),
      fixed_text(-0.125, 2),
      stream.str(),
      message_of<std::invalid_argument>([] {
        complete_parameters(kDescriptions, {{"weight", 3e6}});
      }),
  };
}

TEST(ShortestText, IsTheSameInAnyLocale) {
  const std::vector<std::string> before = texts();
  EXPECT_EQ(before[1], "1234567.0");
  EXPECT_EQ(before[4], "1234567.5");
  EXPECT_EQ(before[6], "[0.25, 1.0]");
  EXPECT_EQ(before[8], "1234567.250000");
  EXPECT_EQ(before[9], "-0.12");
  const ForeignLocale locale;
  std::ostringstream foreign;
  foreign << 1234.5;
  ASSERT_EQ(foreign.str(), "1.234,5");
  ASSERT_EQ(std::to_string(0.5), "0,500000");
  EXPECT_EQ(texts(), before);
  EXPECT_EQ(parse_number("0.5"), 0.5);
  EXPECT_EQ(parse_number("0,5"), std::nullopt);
  EXPECT_EQ(parse_number("1.234,5"), std::nullopt);
}

TEST(ShortestText, ReadsBackAsTheSameNumber) {
  std::mt19937_64 draws(1);
  std::lognormal_distribution<double> sizes(0, 20);
  for (int i = 0; i < 1000; ++i) {
    const double value = i % 2 == 0 ? sizes(draws) : -sizes(draws);
    EXPECT_EQ(std::strtod(shortest_text(value).c_str(), nullptr), value);
    EXPECT_EQ(std::strtod(to_string(value).c_str(), nullptr), value);
    const auto single = static_cast<float>(value);
    EXPECT_EQ(std::strtof(shortest_text(single).c_str(), nullptr), single);
  }
}

}  // namespace
}  // namespace walker
