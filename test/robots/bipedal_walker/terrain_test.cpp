#include "robots/bipedal_walker/terrain.h"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace walker::bipedal_walker
