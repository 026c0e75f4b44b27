// Grounds: BipedalWalker's levels in another size, as lines.
#include "robots/mujoco/level_ground.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "error_message.h"
#include "robots/bipedal_walker/world_settings.h"
#include "robots/mujoco/random_level.h"

namespace walker::mujoco {
namespace {

constexpr double kRounding = 1e-9;  // [m]
constexpr double kStart = 10 * kColumn;
constexpr double kScale = kTerrainStep / kColumn;

/// Returns the height of the highest piece at x that is seen from above.
double top_at(const GroundLine& line, double x) {
  double top = -1e9;
  for (const GroundPiece& piece : line.pieces()) {
    if (!piece.spans(x) || piece.along.x <= 0) continue;
    top = std::max(top, piece.from.y + (x - piece.from.x) * piece.along.y / piece.along.x);
  }
  return top;
}

LevelGround ground_of(const WorldValues& values, std::uint64_t seed) {
  Generator generator(seed);
  return {generator, *level_of(values), {0, 0}};
}

TEST(LevelGroundTest, AWorldWithoutALevelHasNone) {
  for (const WorldValues& values :
       {WorldValues{}, WorldValues{{"gravity", -5}}, WorldValues{{"ground_roughness", 0}}}) {
    EXPECT_FALSE(level_of(values));
  }
  for (const char* name : {"ground_roughness", "pit_gap", "stump_float", "stair_steps"}) {
    EXPECT_TRUE(level_of({{name, 1}})) << name;
  }
}

/// The generator draws the same numbers, so that lengths have the columns' ratio.
TEST(LevelGroundTest, IsBipedalWalkersTerrainInAnotherSize) {
  Generator random(1);
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    const Level level = *level_of(random_level(random));
    Level large = level;
    if (large.obstacle_spacing) *large.obstacle_spacing *= kScale;
    if (large.pit_gap) *large.pit_gap *= kScale;
    if (large.stumps) {
      large.stumps->width *= kScale;
      large.stumps->height *= kScale;
      large.stumps->clearance *= kScale;
    }
    if (large.stairs) {
      large.stairs->tread_width *= kScale;
      large.stairs->rise *= kScale;
    }
    Generator ours(seed);
    Generator theirs(seed);
    const Ground ground = draw_ground(ours, kGroundSize, false, level);
    const Ground expected = bipedal_walker::draw_ground(theirs, false, large);
    ASSERT_EQ(ground.points.size(), 500U);
    const double start = expected.points[0].y;
    for (std::size_t i = 0; i < expected.points.size(); ++i) {
      ASSERT_NEAR(ground.points[i].x * kScale, expected.points[i].x, 1e-6);
      ASSERT_NEAR(ground.points[i].y * kScale, expected.points[i].y - start, 1e-6);
    }
    ASSERT_GE(ground.obstacles.size(), expected.obstacles.size());
    for (std::size_t i = 0; i < expected.obstacles.size(); ++i) {
      for (std::size_t k = 0; k < 4; ++k) {
        ASSERT_NEAR(ground.obstacles[i][k].x * kScale, expected.obstacles[i][k].x, 1e-6);
        ASSERT_NEAR(ground.obstacles[i][k].y * kScale, expected.obstacles[i][k].y - start, 1e-6);
      }
    }
  }
}

/// The line is the ground without holes, apart from pits, and nothing but stumps is above it.
TEST(LevelGroundTest, TheLineIsTheGround) {
  Generator random(2);
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    const WorldValues values = random_level(random);
    const bool has_pits = values.count("pit_gap") != 0;
    const LevelGround ground = ground_of(values, seed);
    int below_rim = 0;
    for (double x = -30; x < 150; x += 0.0437) {
      const double top = top_at(ground.line(), x);
      const GroundBelow below = ground.below(x);
      if (has_pits && std::abs(top - (below.ground - kPitDepth * kColumn)) < kRounding) {
        ++below_rim;
        continue;
      }
      ASSERT_NEAR(top, below.top, 1e-6) << "seed " << seed << " at " << x;
    }
    Generator again(seed);
    const Ground drawn = draw_ground(again, kGroundSize, false, *level_of(values));
    const bool has_wide_pit =
        std::any_of(drawn.of_level.begin(), drawn.of_level.end(), [&drawn](const Obstacle& each) {
          return each.kind == ObstacleKind::pit && each.right - each.left > 2 * kColumn + 0.1 &&
                 each.right <= drawn.points.back().x;
        });
    if (has_wide_pit) {
      EXPECT_GT(below_rim, 0) << "seed " << seed;
    }
  }
}

/// Pieces join, also those of each outline of a floating stump, whose corners turn to the right.
TEST(LevelGroundTest, PiecesAreInOrderAndJoin) {
  Generator random(4);
  int floating = 0;
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    const LevelGround ground = ground_of(random_level(random), seed);
    const std::vector<GroundPiece>& pieces = ground.line().pieces();
    const auto end_of = [&](const Point& point) {
      return std::find_if(pieces.begin(), pieces.end(), [&](const GroundPiece& each) {
        return each.to.x == point.x && each.to.y == point.y;
      });
    };
    double left = -1e9;
    for (const GroundPiece& piece : pieces) {
      ASSERT_LE(left, piece.left());
      left = piece.left();
      ASSERT_NEAR(dot(piece.along, piece.along), 1, 1e-12);
      if (piece.along.x < 0) ++floating;
      if (&piece == &pieces.front()) continue;
      const auto before = end_of(piece.from);
      ASSERT_NE(before, pieces.end()) << "seed " << seed << " at " << piece.from.x;
      ASSERT_EQ(before->along.x, piece.before.x);
      ASSERT_EQ(before->along.y, piece.before.y);
    }
    const double end = 500 * kColumn - kStart;
    for (double x = -kStart; x < kStart - 1e-6; x += 0.1) EXPECT_EQ(ground.below(x).ground, 0);
    const double height = ground.below(end).ground;
    for (double x = end; x < end + 50; x += 1.3) {
      ASSERT_EQ(ground.below(x).ground, height);
      ASSERT_EQ(ground.below(x).top, height);
    }
  }
  EXPECT_GT(floating, 100);
}

TEST(LevelGroundTest, HealthIsMeasuredFromRimsTreadsAndStumps) {
  const LevelGround pits = ground_of({{"pit_gap", 1}}, 1);
  const LevelGround stumps = ground_of({{"stump_height", 0.3}, {"stump_width", 0.5}}, 1);
  const double first = kStart;  // the first obstacle is behind the start pad
  EXPECT_EQ(pits.below(first + kColumn + 0.5).ground, 0);
  EXPECT_EQ(stumps.below(first + 0.25).ground, 0);
  EXPECT_NEAR(stumps.below(first + 0.25).top, 0.3, kRounding);
  EXPECT_EQ(stumps.below(first - 0.01).top, 0);
  EXPECT_EQ(stumps.below(first + 0.51).top, 0);
  const LevelGround floating = ground_of({{"stump_float", 0.4}}, 1);
  EXPECT_NEAR(floating.below(first + 0.1).top, 0.4 + kColumn, kRounding);
  EXPECT_EQ(floating.below(first + 0.1).ground, 0);
  const LevelGround stairs = ground_of({{"stair_height", 0.1}, {"stair_width", 0.5}}, 1);
  const double slope = stairs.below(first + 0.75).ground > 0 ? 1 : -1;
  for (int tread = 0; tread < 3; ++tread) {
    EXPECT_NEAR(stairs.below(first + 0.5 * tread + 0.25).ground, slope * 0.1 * tread, kRounding);
  }
}

/// The scene shows the same ground.
TEST(LevelGroundTest, SceneShowsGroundAndObstacles) {
  Generator random(5);
  for (std::uint64_t seed = 0; seed < 30; ++seed) {
    Generator generator(seed);
    const LevelGround ground(generator, *level_of(random_level(random)), {3, -2});
    Scene scene;
    ground.describe(scene);
    ASSERT_EQ(scene.surface_colors.size(), scene.ground.size());
    ASSERT_FALSE(scene.floor);
    double right = scene.ground[0].points[0][0];
    for (const ScenePolygon& piece : scene.ground) {
      ASSERT_EQ(piece.points.size(), 4U);
      ASSERT_NEAR(piece.points[0][0], right, 1e-4);
      right = piece.points[1][0];
      EXPECT_GT(piece.points[0][1], piece.points[3][1]);
      EXPECT_GT(piece.points[1][1], piece.points[2][1]);
    }
    for (double x = -10; x < 110; x += 0.31) {
      double top = -1e9;
      const auto see = [&](const std::array<double, 2>& from, const std::array<double, 2>& to) {
        if (from[0] > x + 3 || to[0] < x + 3) return;
        const double share = (x + 3 - from[0]) / (to[0] - from[0]);
        top = std::max(top, from[1] + share * (to[1] - from[1]) + 2);
      };
      for (const ScenePolygon& piece : scene.ground) see(piece.points[0], piece.points[1]);
      for (const ScenePolygon& box : scene.obstacles) see(box.points[3], box.points[2]);
      if (top < ground.below(x).ground - 0.1) continue;  // a pit
      ASSERT_NEAR(top, ground.below(x).top, 1e-6) << "seed " << seed << " at " << x;
    }
  }
}

TEST(LevelGroundTest, RefusesLevelsByName) {
  const auto refusal = [](const World& world) {
    return message_of<std::invalid_argument>([&] { check_level(world, kGroundSize, false, ""); });
  };
  EXPECT_EQ(refusal({{"obstacle_spacing", {1, 2}}}),
            "obstacle_spacing = 2 m: has no effect without obstacles; name also sizes of pits, "
            "stumps or stairs");
  EXPECT_EQ(refusal({{"obstacle_spacing", {1, 2}}, {"pit_gap", {1, 1}}}), "nothing thrown");
  EXPECT_EQ(refusal({{"stair_width", {4, 4}}, {"stair_steps", {10, 10}}}), "nothing thrown");
}

}  // namespace
}  // namespace walker::mujoco
