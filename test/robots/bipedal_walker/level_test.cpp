// Levels against POET's formulas (uber-research/poet, bipedal_walker_custom.py), restated here in
// terms of the finished ground.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>

#include "robots/bipedal_walker/random_world.h"
#include "robots/bipedal_walker/specification.h"

namespace walker::bipedal_walker {
namespace {

constexpr int kLevels = 1000;
constexpr double kRounding = 1e-9;  // [m]
constexpr double kDepth = 4 * kTerrainStep;

struct Box {
  double left, right, bottom, top;
};

Box box_of(const std::array<Point, 4>& corners) {
  const auto by_x = [](const Point& a, const Point& b) { return a.x < b.x; };
  const auto by_y = [](const Point& a, const Point& b) { return a.y < b.y; };
  const auto [left, right] = std::minmax_element(corners.begin(), corners.end(), by_x);
  const auto [bottom, top] = std::minmax_element(corners.begin(), corners.end(), by_y);
  for (const Point& corner : corners) {
    EXPECT_TRUE(corner.x == left->x || corner.x == right->x);
    EXPECT_TRUE(corner.y == bottom->y || corner.y == top->y);
  }
  return {left->x, right->x, bottom->y, top->y};
}

std::vector<Box> boxes_of(const Ground& ground) {
  std::vector<Box> boxes;
  for (const auto& obstacle : ground.obstacles) boxes.push_back(box_of(obstacle));
  return boxes;
}

/// Returns the column at x, which must be one.
int column_at(double x) {
  const double column = x / kTerrainStep;
  EXPECT_NEAR(column, std::round(column), kRounding);
  return static_cast<int>(std::lround(column));
}

const Point& ground_at(const Ground& ground, int column) {
  return ground.points.at(static_cast<std::size_t>(column));
}

Ground level(const WorldValues& values, std::uint64_t seed, bool hardcore = false) {
  Generator generator(seed);
  return draw_ground(generator, hardcore, settings_of(values).level);
}

using Numbers = std::vector<double>;

Numbers numbers_of(const Ground& ground) {
  Numbers numbers;
  for (const Point& point : ground.points) numbers.insert(numbers.end(), {point.x, point.y});
  for (const auto& obstacle : ground.obstacles) {
    for (const Point& point : obstacle) numbers.insert(numbers.end(), {point.x, point.y});
  }
  return numbers;
}

TEST(LevelTest, GymnasiumsRoughnessHasGymnasiumsBits) {
  for (const bool hardcore : {false, true}) {
    for (std::uint64_t seed = 0; seed < 100; ++seed) {
      Generator plain(seed);
      Generator other(seed);
      const Ground ground = draw_ground(plain, hardcore);
      const Level same = settings_of({{"ground_roughness", 1}}).level;
      EXPECT_EQ(numbers_of(draw_ground(other, hardcore, same)), numbers_of(ground));
      EXPECT_EQ(other.state(), plain.state());
    }
  }
}

/// On grass the slope is v = 0.8 v + 0.01 sign(height of the start pad - y) + u / 30 per step, with
/// u uniform in [-1, 1], and y rises by v times the roughness. The first step of a stretch is
/// level.
TEST(LevelTest, RoughnessIsAFactorOfTheSlope) {
  Generator generator(5);
  double sum = 0;
  double squares = 0;
  int draws = 0;
  for (int i = 0; i < kLevels; ++i) {
    const double roughness = generator.uniform(0.1, 10);
    const Ground ground = level({{"ground_roughness", roughness}}, i);
    double velocity = 0;
    for (int column = 1; column < kTerrainLength; ++column) {
      const double y = ground_at(ground, column - 1).y;
      const double rise = ground_at(ground, column).y - y;
      if (rise == 0 && column > 1) continue;
      const double sign = y < kTerrainHeight ? 1 : y > kTerrainHeight ? -1 : 0;
      const double before = 0.8 * velocity + 0.01 * sign;
      velocity = rise / roughness;
      const double u = (velocity - before) * kScale;
      if (column <= kTerrainStartPad) {
        EXPECT_NEAR(u, 0, 1e-6);
        continue;
      }
      ASSERT_LE(std::abs(u), 1 + 1e-6) << "level " << i << ", column " << column;
      sum += u;
      squares += u * u;
      ++draws;
    }
  }
  ASSERT_GT(draws, 100000);
  EXPECT_NEAR(sum / draws, 0, 0.01);
  EXPECT_NEAR(squares / draws, 1.0 / 3, 0.01);
}

TEST(LevelTest, WithoutRoughnessTheGroundIsLevel) {
  for (const Point& point : level({{"ground_roughness", 0}}, 3).points) {
    EXPECT_EQ(point.y, kTerrainHeight);
  }
}

TEST(LevelTest, StumpsHaveTheirSizes) {
  Generator generator(1);
  std::set<int> spacings;  // [steps]
  int count = 0;
  for (int i = 0; i < kLevels; ++i) {
    const double width = generator.uniform(0.05, 4);
    const double height = generator.uniform(0.05, 3);
    const double clearance = i % 2 == 0 ? 0 : generator.uniform(0, 3);
    const Ground ground =
        level({{"stump_width", width}, {"stump_height", height}, {"stump_float", clearance}}, i);
    const int columns = static_cast<int>(std::ceil(width / kTerrainStep));
    int end = kTerrainStartPad;
    for (const Box& box : boxes_of(ground)) {
      const int column = column_at(box.left);
      ASSERT_NEAR(box.right - box.left, width, kRounding);
      ASSERT_NEAR(box.top - box.bottom, height, kRounding);
      const double y = ground_at(ground, column).y;
      ASSERT_NEAR(box.bottom - y, clearance, kRounding);
      const int last = std::min(column + columns, kTerrainLength) - 1;
      for (int k = column; k <= last; ++k) ASSERT_EQ(ground_at(ground, k).y, y);
      if (count++ == 0) {
        EXPECT_EQ(column, kTerrainStartPad);
      }
      if (column != kTerrainStartPad) spacings.insert(column - end);
      end = column + columns;
    }
  }
  EXPECT_EQ(spacings, (std::set<int>{5, 6, 7, 8, 9})) << "Gymnasium's and POET's grass";
  EXPECT_GT(count, 5 * kLevels);
}

/// One flight as POET makes it, with widths in whole steps.
void expect_poets_flight(const Ground& ground, const std::vector<Box>& boxes, int width,
                         double rise, bool is_up) {
  const int first = column_at(boxes[0].left);
  const int steps = static_cast<int>(boxes.size());
  const double y = ground_at(ground, first).y;
  const int slope = is_up ? 1 : -1;
  for (int s = 0; s < steps; ++s) {
    const Box& box = boxes[static_cast<std::size_t>(s)];
    ASSERT_NEAR(box.left, (first + s * width) * kTerrainStep, kRounding);
    ASSERT_NEAR(box.right, (first + (s + 1) * width) * kTerrainStep, kRounding);
    ASSERT_NEAR(box.top, y + s * slope * rise, kRounding);
    ASSERT_NEAR(box.bottom, y + (s * slope - 1) * rise, kRounding);
  }
  for (int s = 0; s < steps * width && first + 1 + s < kTerrainLength; ++s) {
    const int n = s / width;
    ASSERT_NEAR(ground_at(ground, first + 1 + s).y, y + n * rise * slope - (is_up ? 0 : rise),
                kRounding);
  }
}

TEST(LevelTest, StairsHaveTheirSizes) {
  Generator generator(2);
  int ups = 0;
  int downs = 0;
  for (int i = 0; i < kLevels; ++i) {
    const auto width = static_cast<int>(generator.integers(2, 6));
    const double rise = generator.uniform(0.05, 3);
    const auto steps = static_cast<std::size_t>(generator.integers(1, 10));
    const Ground ground = level({{"stair_width", width * kTerrainStep},
                                 {"stair_height", rise},
                                 {"stair_steps", static_cast<double>(steps)}},
                                i);
    const std::vector<Box> boxes = boxes_of(ground);
    ASSERT_EQ(boxes.size() % steps, 0U);
    for (std::size_t k = 0; k < boxes.size(); k += steps) {
      const std::vector<Box> flight(boxes.begin() + k, boxes.begin() + k + steps);
      // A flight of one tread is up if the ground beyond it is level with its top.
      const int first = column_at(flight[0].left);
      if (first + 1 >= kTerrainLength) continue;
      const bool is_up = std::abs(ground_at(ground, first + 1).y - flight[0].top) < kRounding;
      (is_up ? ups : downs) += 1;
      ASSERT_NO_FATAL_FAILURE(expect_poets_flight(ground, flight, width, rise, is_up))
          << "level " << i << ", flight " << k / steps;
    }
  }
  EXPECT_GT(ups + downs, 2 * kLevels);
  EXPECT_NEAR(ups, downs, 0.1 * (ups + downs));
}

/// Treads of any width are as wide as named, and cover the ground.
TEST(LevelTest, StairsCoverTheGround) {
  Generator generator(3);
  for (int i = 0; i < kLevels; ++i) {
    const double width = generator.uniform(0.5, 3);
    const double rise = generator.uniform(0.05, 3);
    const Ground ground =
        level({{"ground_roughness", 0}, {"stair_width", width}, {"stair_height", rise}}, i);
    for (const Box& box : boxes_of(ground)) {
      ASSERT_NEAR(box.right - box.left, width, kRounding);
      ASSERT_NEAR(box.top - box.bottom, rise, kRounding);
      for (const Point& point : ground.points) {
        if (point.x < box.left + kRounding || point.x > box.right - kRounding) continue;
        ASSERT_LE(point.y, box.top + kRounding) << "level " << i << " at " << point.x;
      }
    }
  }
}

TEST(LevelTest, PitsHaveTheirSizes) {
  Generator generator(4);
  int count = 0;
  for (int i = 0; i < kLevels; ++i) {
    const double gap =
        i % 5 == 0 ? static_cast<double>(i % 8) * kTerrainStep : generator.uniform(0, 10);
    const Ground ground = level({{"pit_gap", gap}}, i);
    const std::vector<Box> boxes = boxes_of(ground);
    ASSERT_EQ(boxes.size() % 2, 0U);
    for (std::size_t k = 0; k < boxes.size(); k += 2) {
      const Box& near = boxes[k];
      const Box& far = boxes[k + 1];
      const int first = column_at(near.left);
      const double y = ground_at(ground, first).y;
      ASSERT_NEAR(far.left - near.right, gap, kRounding);
      for (const Box& wall : {near, far}) {
        ASSERT_NEAR(wall.right - wall.left, kTerrainStep, kRounding);
        ASSERT_NEAR(wall.top, y, kRounding);
        ASSERT_NEAR(wall.bottom, y - kDepth, kRounding);
      }
      // The ground is deep up to the second wall, and level with its top from its far edge on.
      int column = first + 1;
      for (; column < kTerrainLength; ++column) {
        const Point& point = ground_at(ground, column);
        if (std::abs(point.y - y) < kRounding) break;
        ASSERT_NEAR(point.y, y - kDepth, kRounding);
        ASSERT_LT(point.x, far.right + kRounding);
      }
      if (column == kTerrainLength) continue;
      ASSERT_NEAR(ground_at(ground, column).x, far.right, kTerrainStep * 1e-5) << "gap " << gap;
      ASSERT_LT(ground_at(ground, column - 1).x, ground_at(ground, column).x);
      ++count;
    }
  }
  EXPECT_GT(count, kLevels);
}

struct Kind {
  const char* name;
  std::pair<std::string, double> size;
  double height;  ///< of each box [m]
};

TEST(LevelTest, HasTheKindsThatAreNamed) {
  const std::array<Kind, 3> kinds{{{"stump", {"stump_height", 1.1}, 1.1},
                                   {"stairs", {"stair_height", 0.3}, 0.3},
                                   {"pit", {"pit_gap", 1}, kDepth}}};
  const auto kind_of = [&kinds](const Box& box) {
    for (const Kind& kind : kinds) {
      if (std::abs(box.top - box.bottom - kind.height) < kRounding) return kind.name;
    }
    return "other";
  };
  for (const bool hardcore : {false, true}) {
    for (unsigned chosen = 1; chosen < 8; ++chosen) {
      WorldValues values;
      std::set<std::string> expected;
      for (std::size_t i = 0; i < kinds.size(); ++i) {
        if ((chosen >> i & 1U) == 0) continue;
        values.insert(kinds[i].size);
        expected.insert(kinds[i].name);
      }
      std::map<std::string, double> found;
      for (int i = 0; i < 100; ++i) {
        for (const Box& box : boxes_of(level(values, i, hardcore))) ++found[kind_of(box)];
      }
      std::set<std::string> names;
      for (const auto& [name, count] : found) names.insert(name);
      EXPECT_EQ(names, expected);
      if (expected.count("stump") == 0) continue;
      // A flight of stairs has 3 boxes, a pit 2.
      const double total = found["stump"] + found["stairs"] / 3 + found["pit"] / 2;
      EXPECT_NEAR(found["stump"] / total, 1.0 / static_cast<double>(expected.size()), 0.08);
    }
  }
}

TEST(LevelTest, SizesThatAreNotNamedAreGymnasiumsSmallest) {
  const Ground stumps = level({{"stump_float", 0.2}}, 1);
  ASSERT_FALSE(stumps.obstacles.empty());
  for (const Box& box : boxes_of(stumps)) {
    EXPECT_NEAR(box.right - box.left, kTerrainStep, kRounding);
    EXPECT_NEAR(box.top - box.bottom, kTerrainStep, kRounding);
  }
  const Ground stairs = level({{"stair_height", 0.2}}, 1);
  ASSERT_EQ(stairs.obstacles.size() % 3, 0U);
  for (const Box& box : boxes_of(stairs)) {
    EXPECT_NEAR(box.right - box.left, 4 * kTerrainStep, kRounding);
  }
}

TEST(LevelTest, SpacingIsTheGrassBetweenObstacles) {
  for (const int steps : {1, 3, 12}) {
    const Ground ground = level(
        {{"stump_width", 2 * kTerrainStep}, {"obstacle_spacing", (steps + 0.3) * kTerrainStep}}, 7);
    const std::vector<Box> boxes = boxes_of(ground);
    ASSERT_GT(boxes.size(), 8U);
    for (std::size_t i = 1; i < boxes.size(); ++i) {
      EXPECT_NEAR(boxes[i].left - boxes[i - 1].right, steps * kTerrainStep, kRounding);
    }
  }
}

TEST(LevelTest, HardcoreKeepsItsObstaclesIfNoneIsNamed) {
  const Ground hardcore = level({}, 5, true);
  const Ground rough = level({{"ground_roughness", 3}}, 5, true);
  ASSERT_EQ(rough.obstacles.size(), hardcore.obstacles.size());
  for (std::size_t i = 0; i < rough.obstacles.size(); ++i) {
    for (std::size_t k = 0; k < 4; ++k) {
      EXPECT_EQ(rough.obstacles[i][k].x, hardcore.obstacles[i][k].x);
    }
  }
  const Ground dense = level({{"obstacle_spacing", 0.5}}, 5, true);
  EXPECT_GT(dense.obstacles.size(), hardcore.obstacles.size());
  EXPECT_TRUE(dense.obstacles_are_gymnasiums);
}

/// 4 steps are 1.8666666666666667 m.
TEST(LevelTest, RoundedDecimalsAreWholeSteps) {
  const WorldValues exact{{"stair_width", 4 * kTerrainStep}, {"pit_gap", 2 * kTerrainStep}};
  for (const double rounding : {-4e-8, 4e-8}) {
    WorldValues rounded = exact;
    for (auto& [name, value] : rounded) value += rounding;
    for (int seed = 0; seed < 20; ++seed) {
      const Numbers expected = numbers_of(level(exact, seed));
      const Numbers numbers = numbers_of(level(rounded, seed));
      ASSERT_EQ(numbers.size(), expected.size());
      for (std::size_t i = 0; i < numbers.size(); ++i) ASSERT_NEAR(numbers[i], expected[i], 1e-6);
    }
  }
}

TEST(LevelTest, SceneShowsGroundAndObstacles) {
  for (int seed = 0; seed < 20; ++seed) {
    const Ground ground = level(
        {{"stair_height", 2}, {"stair_steps", 9}, {"stump_width", 1.3}, {"pit_gap", 1.7}}, seed);
    Scene scene;
    describe_scene(ground, {}, scene);
    ASSERT_EQ(scene.obstacles.size(), ground.obstacles.size());
    for (std::size_t i = 0; i < scene.obstacles.size(); ++i) {
      for (std::size_t k = 0; k < 4; ++k) {
        EXPECT_EQ(scene.obstacles[i].points[k][0], ground.obstacles[i][k].x);
        EXPECT_EQ(scene.obstacles[i].points[k][1], ground.obstacles[i][k].y);
      }
    }
    for (const ScenePolygon& piece : scene.ground) {
      EXPECT_GT(piece.points[0][1], piece.points[3][1]) << "not upside down";
      EXPECT_GT(piece.points[1][1], piece.points[2][1]);
    }
  }
}

}  // namespace
}  // namespace walker::bipedal_walker
