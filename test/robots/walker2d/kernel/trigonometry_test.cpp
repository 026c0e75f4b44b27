#include "robots/walker2d/kernel/trigonometry.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "bits.h"

namespace walker::walker2d {
namespace {

void expect_as_sin_and_cos(double angle) {
  double sine = 0;
  double cosine = 0;
  sine_and_cosine_of(angle, &sine, &cosine);
  ASSERT_EQ(to_bits(sine), to_bits(std::sin(angle))) << std::hexfloat << angle;
  ASSERT_EQ(to_bits(cosine), to_bits(std::cos(angle))) << std::hexfloat << angle;
}

void expect_all_as_sin_and_cos() {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> power(-320, 308);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int i = 0; i < 300000; ++i) {
    expect_as_sin_and_cos(std::pow(10.0, power(random)) * unit(random));
    expect_as_sin_and_cos(3 * unit(random));
    if (testing::Test::HasFatalFailure()) return;
  }
  for (const double angle : {0.0, -0.0, 5e-324, std::numeric_limits<double>::max()}) {
    expect_as_sin_and_cos(angle);
  }
}

/// Tests the default, then sincos if the C library's sincos has the same bits.
TEST(TrigonometryTest, HasTheBitsOfSinAndCos) {
  expect_all_as_sin_and_cos();
  choose_sine_and_cosine();
  expect_all_as_sin_and_cos();
}

}  // namespace
}  // namespace walker::walker2d
