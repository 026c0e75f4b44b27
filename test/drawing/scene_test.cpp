// Drawings of the scene: ground, obstacles, flags and the floor that follows the walker.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "drawing/drawing.h"
#include "drawing/shown_walker.h"
#include "test_name.h"

namespace walker::test {
namespace {

class SceneOfEveryEnvironment : public testing::TestWithParam<std::string> {};

TEST_P(SceneOfEveryEnvironment, IsDrawable) {
  const ShownWalker shown(GetParam());
  const std::vector<Drawing> drawings = scene_drawings(shown.scene);
  for (const Drawing& drawing : drawings) expect_drawable(drawing);
  EXPECT_EQ(find(drawings, "ground")->points.empty(), shown.scene.ground.empty());
  EXPECT_EQ(find(drawings, "obstacles")->points.empty(), shown.scene.obstacles.empty());
  EXPECT_EQ(find(drawings, "clouds")->points.empty(), shown.scene.clouds.empty());
  EXPECT_EQ(find(drawings, "flags")->points.empty(), shown.scene.flags.empty());
  EXPECT_TRUE(!shown.scene.ground.empty() || shown.scene.floor) << "nothing to walk on";
}

INSTANTIATE_TEST_SUITE_P(All, SceneOfEveryEnvironment, testing::ValuesIn(ids()), kNameOfId);

/// Grass and the earth below it cover exactly the polygon, without gaps or overlaps.
TEST(SceneDrawings, CoverEachPieceOfGroundOnce) {
  Scene scene;
  scene.ground.push_back({{{0, 2}, {3, 1}, {3, -1}, {0, -1}}, {0.4, 0.8, 0.3, 1}});
  const std::vector<Drawing> drawings = scene_drawings(scene);
  const Drawing& ground = *find(drawings, "ground");
  double nearest = std::numeric_limits<double>::infinity();
  for (const auto& point : ground.points) nearest = std::min(nearest, point[1]);
  double area = 0;
  for (std::size_t i = 0; i < ground.points.size(); i += 3) {
    const auto& [a, b, c] = std::tie(ground.points[i], ground.points[i + 1], ground.points[i + 2]);
    if (a[1] != nearest || b[1] != nearest || c[1] != nearest) continue;
    area += std::abs((b[0] - a[0]) * (c[2] - a[2]) - (c[0] - a[0]) * (b[2] - a[2])) / 2;
    for (const auto* point : {&a, &b, &c}) {
      EXPECT_TRUE((*point)[0] == 0 || (*point)[0] == 3) << (*point)[0];
      EXPECT_GE((*point)[2], -1);
      EXPECT_LE((*point)[2], 2 - (*point)[0] / 3);
    }
  }
  EXPECT_NEAR(area, 7.5, 1e-12);
}

TEST(SceneDrawings, HaveTheObstaclesExactOutlines) {
  const ShownWalker shown("BipedalWalkerHardcore-v3");
  std::set<std::pair<double, double>> outlines;
  for (const ScenePolygon& obstacle : shown.scene.obstacles) {
    for (const auto& [x, z] : obstacle.points) outlines.emplace(x, z);
  }
  const std::vector<Drawing> drawings = scene_drawings(shown.scene);
  for (const char* name : {"obstacles", "obstacle_outlines"}) {
    std::set<std::pair<double, double>> drawn;
    for (const auto& [x, y, z] : find(drawings, name)->points) drawn.emplace(x, z);
    EXPECT_EQ(drawn, outlines) << name;
  }
}

/// rviz would show pieces of both if two faces were in one plane.
TEST(SceneDrawings, HaveNoSurfaceInThePlaneOfAnObstaclesSide) {
  Scene scene;
  for (const double x : {0.0, 1.0, 2.0, 3.0}) {
    scene.ground.push_back({{{x, 0}, {x + 1, 0}, {x + 1, -1}, {x, -1}}, {0.4, 0.8, 0.3, 1}});
  }
  scene.obstacles.push_back({{{0.5, 0}, {2, 0}, {2, 1}, {0.5, 1}}, {1, 1, 1, 1}});
  scene.obstacles.push_back({{{2.5, -1}, {2.75, -1}, {2.75, 0}, {2.5, 0}}, {1, 1, 1, 1}});
  scene.obstacles.push_back({{{3, 0.5}, {4, 0.5}, {4, 1}, {3, 1}}, {1, 1, 1, 1}});
  const std::vector<Drawing> drawings = scene_drawings(scene);
  const Drawing& ground = *find(drawings, "ground");
  double length = 0;  // of the surface, from each triangle half of its own
  for (std::size_t i = 0; i < ground.points.size(); i += 3) {
    const auto& [a, b, c] = std::tie(ground.points[i], ground.points[i + 1], ground.points[i + 2]);
    if (a[2] != 0 || b[2] != 0 || c[2] != 0) continue;
    const auto [left, right] = std::minmax({a[0], b[0], c[0]});
    length += (right - left) / 2;
    EXPECT_TRUE(right <= 0.5 || (left >= 2 && right <= 2.5) || left >= 2.75) << left;
  }
  EXPECT_NEAR(length, 0.5 + 0.5 + 0.25 + 1, 1e-12);
}

/// Gymnasium's pennant is 25 pixels long and 10 high, on a pole of 50 pixels.
TEST(SceneDrawings, HavePennantsOfGymnasiumsProportions) {
  Scene scene;
  scene.flags.push_back({2, 3, 5, {0.9, 0.2, 0, 1}});
  const std::vector<Drawing> drawings = scene_drawings(scene);
  const std::vector<Vector3>& points = find(drawings, "flags")->points;
  ASSERT_EQ(points.size(), 3U);
  EXPECT_DOUBLE_EQ(points[0][0], 2);
  EXPECT_DOUBLE_EQ(points[0][2], 8);
  EXPECT_DOUBLE_EQ(points[1][0], 2);
  EXPECT_DOUBLE_EQ(points[1][2], 7);
  EXPECT_DOUBLE_EQ(points[2][0], 4.5);
  EXPECT_DOUBLE_EQ(points[2][2], 7.5);
}

TEST(SceneDrawings, LeaveOutNonFiniteShapes) {
  ShownWalker shown("BipedalWalkerHardcore-v3");
  const double nan = std::numeric_limits<double>::quiet_NaN();
  shown.scene.ground[3].points[1][1] = nan;
  shown.scene.obstacles[0].points[0][0] = nan;
  shown.scene.clouds[0].points[0][0] = std::numeric_limits<double>::infinity();
  shown.scene.flags[0].height = nan;
  for (const Drawing& drawing : scene_drawings(shown.scene)) expect_drawable(drawing);
}

const Floor kFloor{0.25, 0.5, {{{1, 1, 1, 1}, {0, 0, 0, 1}}}};

/// Red of the tiles in the row nearest to the viewer, which is not paled, keyed by tile index.
std::map<long, double> nearest_tiles(double walker_x) {
  const Drawing drawing = floor_drawing(kFloor, floor_center(kFloor, walker_x));
  expect_drawable(drawing);
  constexpr std::size_t kTilePoints = 6;
  double nearest = std::numeric_limits<double>::infinity();
  for (const auto& point : drawing.points) nearest = std::min(nearest, point[1]);
  std::map<long, double> tones;
  for (std::size_t i = 0; i < drawing.points.size(); i += kTilePoints) {
    double x = drawing.points[i][0];
    double y = drawing.points[i][1];
    for (std::size_t k = i; k < i + kTilePoints; ++k) {
      EXPECT_EQ(drawing.points[k][2], kFloor.z);
      x = std::min(x, drawing.points[k][0]);
      y = std::min(y, drawing.points[k][1]);
    }
    if (y == nearest) tones[std::lround(x / kFloor.tile)] = drawing.colors[i][0];
  }
  return tones;
}

TEST(FloorDrawing, AlternatesTwoColours) {
  const std::map<long, double> tones = nearest_tiles(0);
  ASSERT_GT(tones.size(), 20U);
  for (auto next = std::next(tones.begin()); next != tones.end(); ++next) {
    EXPECT_EQ(next->first, std::prev(next)->first + 1) << "a gap";
    EXPECT_NE(next->second, std::prev(next)->second);
  }
}

TEST(FloorDrawing, FollowsTheWalkerWithoutMovingItsTiles) {
  const std::map<long, double> at_home = nearest_tiles(0);
  for (const double x : {-1000.3, -2.0, 0.9, 1.1, 3.7, 123456.7}) {
    SCOPED_TRACE(x);
    const std::map<long, double> tones = nearest_tiles(x);
    // The view shows about 4 m to either side.
    EXPECT_LT(static_cast<double>(tones.begin()->first) * kFloor.tile, x - 5);
    EXPECT_GT(static_cast<double>(tones.rbegin()->first) * kFloor.tile, x + 5);
    for (const auto& [tile, tone] : tones) {
      EXPECT_EQ(tone, tile % 2 == 0 ? at_home.at(0) : at_home.at(1)) << tile;
    }
  }
  EXPECT_EQ(floor_center(kFloor, 0.3), floor_center(kFloor, -0.3)) << "redrawn at every step";
}

}  // namespace
}  // namespace walker::test
