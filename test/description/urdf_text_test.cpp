// Numbers survive the round trip through a robot description.
#include "description/urdf_text.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <random>
#include <vector>

#include "foreign_locale.h"

namespace walker {
namespace {

TEST(NumberText, IsWhatOneWouldWrite) {
  for (const Precision precision : {Precision::in_single, Precision::in_double}) {
    EXPECT_EQ(number_text(0, precision), "0");
    EXPECT_EQ(number_text(-0.0, precision), "0");
    EXPECT_EQ(number_text(80, precision), "80");
    EXPECT_EQ(number_text(-10000, precision), "-10000");
    EXPECT_EQ(number_text(0.1, precision), "0.1");
  }
  EXPECT_EQ(number_text(double{0.1F}, Precision::in_single), "0.1");
  EXPECT_EQ(number_text(0.19999999999999996, Precision::in_double), "0.19999999999999996");
}

TEST(NumberText, IsTheSameInAnyLocale) {
  const ForeignLocale locale;
  EXPECT_EQ(number_text(-10000.5, Precision::in_double), "-10000.5");
  EXPECT_EQ(number_text(0.1, Precision::in_single), "0.1");
}

TEST(NumberText, ReadsBackAsTheSameNumber) {
  std::mt19937_64 draws(1);
  std::lognormal_distribution<double> sizes(0, 20);
  for (int i = 0; i < 1000; ++i) {
    const double value = i % 2 == 0 ? sizes(draws) : -sizes(draws);
    EXPECT_EQ(std::strtod(number_text(value, Precision::in_double).c_str(), nullptr), value);
    const auto single = static_cast<float>(value);
    EXPECT_EQ(std::strtof(number_text(single, Precision::in_single).c_str(), nullptr), single);
  }
}

TEST(ListText, HasBlanksBetween) {
  EXPECT_EQ(list_text(std::vector<double>{}, Precision::in_double), "");
  EXPECT_EQ(list_text(std::vector<double>{1, -0.5, 0}, Precision::in_double), "1 -0.5 0");
}

}  // namespace
}  // namespace walker
