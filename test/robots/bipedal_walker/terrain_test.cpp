#include "robots/bipedal_walker/terrain.h"

#include <gtest/gtest.h>

#include <cmath>

#include "recording.h"
#include "robots/bipedal_walker/terrain_numbers.h"

namespace walker::bipedal_walker {
namespace {

TEST(Terrain, EqualsGymnasiumsInEveryDouble) {
  Recording recording("terrains.txt");
  int compared[2] = {0, 0};
  while (recording.has_more()) {
    const bool hardcore = recording.next<bool>();
    const auto seed = recording.next<std::uint64_t>();
    Hash hash;
    for (const double number : terrain_numbers(hardcore, seed)) hash.add(number);
    ASSERT_EQ(hash.value(), recording.next_hexadecimal())
        << "hardcore " << hardcore << ", seed " << seed;
    ++compared[hardcore ? 1 : 0];
  }
  EXPECT_GE(compared[0], 1000);
  EXPECT_GE(compared[1], 1000);
}

/// Width and height of an obstacle in terrain steps.
struct Size {
  double width;
  double height;
};

Size size_of(const std::array<Point, 4>& obstacle) {
  return {(obstacle[1].x - obstacle[0].x) / kTerrainStep,
          std::abs(obstacle[2].y - obstacle[1].y) / kTerrainStep};
}

TEST(Terrain, PlainHasGrassOnly) {
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    Generator generator(seed);
    const Terrain terrain = generate_terrain(generator, false);
    EXPECT_TRUE(terrain.obstacles.empty());
    for (std::size_t i = 0; i < kTerrainStartPad; ++i) {
      EXPECT_EQ(terrain.ground[i].y, kTerrainHeight) << "the start pad is flat";
    }
  }
}

TEST(Terrain, HardcoreHasStumpsStairsAndPits) {
  int stumps = 0;
  int stairs = 0;
  int pit_walls = 0;
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    Generator generator(seed);
    for (const auto& obstacle : generate_terrain(generator, true).obstacles) {
      const Size size = size_of(obstacle);
      const bool is_pit_wall = std::lround(size.width) == 1 && std::lround(size.height) == 4;
      const bool is_stair = std::lround(size.width) == 4 && std::lround(size.height) == 1;
      const bool is_stump = std::lround(size.width) <= 2 && size.width - size.height < 1e-9 &&
                            size.height - size.width < 1e-9;
      EXPECT_EQ(int{is_pit_wall} + int{is_stair} + int{is_stump}, 1)
          << size.width << " by " << size.height;
      pit_walls += int{is_pit_wall};
      stairs += int{is_stair};
      stumps += int{is_stump};
    }
  }
  EXPECT_GT(stumps, 100);
  EXPECT_GT(stairs, 300);
  EXPECT_GT(pit_walls, 200);
  EXPECT_EQ(pit_walls % 2, 0) << "each pit has two";
}

}  // namespace
}  // namespace walker::bipedal_walker
