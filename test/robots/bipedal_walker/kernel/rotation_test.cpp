// The kernels' sine and cosine have the C library's bits. WALKER_SIM_TEST_ALL_ANGLES tests every
// float below 100.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <random>
#include <vector>

#include "bits.h"
#include "robots/bipedal_walker/kernel/kernel.h"

namespace walker::bipedal_walker {
namespace {

/// Returns the number of angles whose sine or cosine differs, summed over all kernels.
long count_different(const std::vector<float>& angles) {
  long different = 0;
  std::vector<Rotation<float>> expected(angles.size());
  std::transform(angles.begin(), angles.end(), expected.begin(), [](float angle) {
    return Rotation<float>{std::sin(angle), std::cos(angle)};
  });
  std::vector<Rotation<float>> rotations(angles.size());
  for (const Kernel* kernel : kernels()) {
    kernel->rotate(angles.data(), angles.size(), rotations.data());
    for (std::size_t i = 0; i < angles.size(); ++i) {
      const bool is_same = float_bits(rotations[i].sine) == float_bits(expected[i].sine) &&
                           float_bits(rotations[i].cosine) == float_bits(expected[i].cosine);
      different += is_same ? 0 : 1;
    }
  }
  return different;
}

TEST(RotationTest, HasTheLibrarysBits) {
  std::mt19937 random(1);
  std::vector<float> angles(1000003);
  for (float& angle : angles) {
    angle = from_float_bits(static_cast<std::uint32_t>(random()));
    if (!std::isfinite(angle)) angle = 0;
  }
  EXPECT_EQ(count_different(angles), 0);
}

/// Multiples of pi/8 and the thresholds between formulas, with 1000 floats on either side.
TEST(RotationTest, HasTheLibrarysBitsWhereFormulasChange) {
  std::vector<float> angles{0.0F,
                            -0.0F,
                            std::numeric_limits<float>::min(),
                            std::numeric_limits<float>::denorm_min(),
                            std::numeric_limits<float>::max(),
                            0x1p-12F,
                            16.0F};
  for (int i = 1; i < 100; ++i) angles.push_back(static_cast<float>(i * M_PI / 8));
  const std::size_t count = angles.size();
  for (std::size_t i = 0; i < count; ++i) {
    for (int k = -1000; k <= 1000; ++k) {
      const float angle = from_float_bits(float_bits(angles[i]) + static_cast<std::uint32_t>(k));
      if (!std::isfinite(angle)) continue;
      angles.push_back(angle);
      angles.push_back(-angle);
    }
  }
  EXPECT_EQ(count_different(angles), 0);
}

TEST(RotationTest, LanesAreIndependent) {
  const float inf = std::numeric_limits<float>::infinity();
  for (const float odd : {1e6F, inf, -inf, std::nanf("")}) {
    for (std::size_t lane = 0; lane < 16; ++lane) {
      std::vector<float> angles(16, 1.25F);
      angles[lane] = odd;
      EXPECT_EQ(count_different(angles), 0) << odd << " in lane " << lane;
    }
  }
}

/// Every float with WALKER_SIM_TEST_ALL_ANGLES (two billion), otherwise one in 1009.
TEST(RotationTest, HasTheLibrarysBitsBelow100) {
  const std::uint32_t stride = std::getenv("WALKER_SIM_TEST_ALL_ANGLES") != nullptr ? 1 : 1009;
  constexpr std::uint32_t kChunk = 1U << 20U;
  const std::uint32_t end = float_bits(100);
  std::vector<float> angles(kChunk);
  for (std::uint32_t first = 0; first < end; first += kChunk * stride) {
    for (std::uint32_t i = 0; i < kChunk; ++i) angles[i] = from_float_bits(first + i * stride);
    ASSERT_EQ(count_different(angles), 0) << "from " << angles[0];
    std::transform(angles.begin(), angles.end(), angles.begin(),
                   [](float angle) { return -angle; });
    ASSERT_EQ(count_different(angles), 0) << "from " << angles[0];
  }
}

}  // namespace
}  // namespace walker::bipedal_walker
