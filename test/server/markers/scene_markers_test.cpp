// Markers of the scene: ground, obstacles, flags and the floor that follows the walker.
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

#include <ros/serialization.h>

#include "server/markers/drawable.h"
#include "server/markers/markers.h"
#include "test_name.h"

namespace walker::test {
namespace {

class SceneOfEveryEnvironment : public testing::TestWithParam<std::string> {};

TEST_P(SceneOfEveryEnvironment, IsDrawable) {
  const ShownWalker shown(GetParam());
  const MarkerArray array = scene_markers(shown.scene, header());
  ASSERT_FALSE(array.markers.empty());
  EXPECT_EQ(array.markers.front().action, Marker::DELETEALL)
      << "markers of the previous episode remain";
  for (const Marker& marker : array.markers) expect_drawable(marker);
  EXPECT_EQ(find(array, "ground") != nullptr, !shown.scene.ground.empty());
  EXPECT_EQ(find(array, "obstacles") != nullptr, !shown.scene.obstacles.empty());
  EXPECT_EQ(find(array, "clouds") != nullptr, !shown.scene.clouds.empty());
  EXPECT_EQ(find(array, "flags") != nullptr, !shown.scene.flags.empty());
  EXPECT_TRUE(!shown.scene.ground.empty() || shown.scene.floor) << "nothing to walk on";
}

INSTANTIATE_TEST_SUITE_P(All, SceneOfEveryEnvironment, testing::ValuesIn(ids()), kNameOfId);

/// Grass and the earth below it cover exactly the polygon, without gaps or overlaps.
TEST(SceneMarkers, CoverEachPieceOfGroundOnce) {
  Scene scene;
  scene.ground.push_back({{{0, 2}, {3, 1}, {3, -1}, {0, -1}}, {0.4, 0.8, 0.3, 1}});
  const MarkerArray array = scene_markers(scene, header());
  const Marker& ground = *find(array, "ground");
  double nearest = std::numeric_limits<double>::infinity();
  for (const auto& point : ground.points) nearest = std::min(nearest, point.y);
  double area = 0;
  for (std::size_t i = 0; i < ground.points.size(); i += 3) {
    const auto& [a, b, c] = std::tie(ground.points[i], ground.points[i + 1], ground.points[i + 2]);
    if (a.y != nearest || b.y != nearest || c.y != nearest) continue;
    area += std::abs((b.x - a.x) * (c.z - a.z) - (c.x - a.x) * (b.z - a.z)) / 2;
    for (const auto* point : {&a, &b, &c}) {
      EXPECT_TRUE(point->x == 0 || point->x == 3) << point->x;
      EXPECT_GE(point->z, -1);
      EXPECT_LE(point->z, 2 - point->x / 3);
    }
  }
  EXPECT_NEAR(area, 7.5, 1e-12);
}

TEST(SceneMarkers, HaveTheObstaclesExactOutlines) {
  const ShownWalker shown("BipedalWalkerHardcore-v3");
  std::set<std::pair<double, double>> outlines;
  for (const ScenePolygon& obstacle : shown.scene.obstacles) {
    for (const auto& [x, z] : obstacle.points) outlines.emplace(x, z);
  }
  const MarkerArray array = scene_markers(shown.scene, header());
  for (const char* name : {"obstacles", "obstacle_outlines"}) {
    std::set<std::pair<double, double>> drawn;
    for (const auto& point : find(array, name)->points) drawn.emplace(point.x, point.z);
    EXPECT_EQ(drawn, outlines) << name;
  }
}

/// rviz would show pieces of both if two faces were in one plane.
TEST(SceneMarkers, HaveNoSurfaceInThePlaneOfAnObstaclesSide) {
  Scene scene;
  for (const double x : {0.0, 1.0, 2.0, 3.0}) {
    scene.ground.push_back({{{x, 0}, {x + 1, 0}, {x + 1, -1}, {x, -1}}, {0.4, 0.8, 0.3, 1}});
  }
  scene.obstacles.push_back({{{0.5, 0}, {2, 0}, {2, 1}, {0.5, 1}}, {1, 1, 1, 1}});
  scene.obstacles.push_back({{{2.5, -1}, {2.75, -1}, {2.75, 0}, {2.5, 0}}, {1, 1, 1, 1}});
  scene.obstacles.push_back({{{3, 0.5}, {4, 0.5}, {4, 1}, {3, 1}}, {1, 1, 1, 1}});
  const MarkerArray array = scene_markers(scene, header());
  const Marker& ground = *find(array, "ground");
  double length = 0;  // of the surface, from each triangle half of its own
  for (std::size_t i = 0; i < ground.points.size(); i += 3) {
    const auto& [a, b, c] = std::tie(ground.points[i], ground.points[i + 1], ground.points[i + 2]);
    if (a.z != 0 || b.z != 0 || c.z != 0) continue;
    const auto [left, right] = std::minmax({a.x, b.x, c.x});
    length += (right - left) / 2;
    EXPECT_TRUE(right <= 0.5 || (left >= 2 && right <= 2.5) || left >= 2.75) << left;
  }
  EXPECT_NEAR(length, 0.5 + 0.5 + 0.25 + 1, 1e-12);
}

/// Gymnasium's pennant is 25 pixels long and 10 high, on a pole of 50 pixels.
TEST(SceneMarkers, HavePennantsOfGymnasiumsProportions) {
  Scene scene;
  scene.flags.push_back({2, 3, 5, {0.9, 0.2, 0, 1}});
  const MarkerArray array = scene_markers(scene, header());
  const std::vector<geometry_msgs::Point>& points = find(array, "flags")->points;
  ASSERT_EQ(points.size(), 3U);
  EXPECT_DOUBLE_EQ(points[0].x, 2);
  EXPECT_DOUBLE_EQ(points[0].z, 8);
  EXPECT_DOUBLE_EQ(points[1].x, 2);
  EXPECT_DOUBLE_EQ(points[1].z, 7);
  EXPECT_DOUBLE_EQ(points[2].x, 4.5);
  EXPECT_DOUBLE_EQ(points[2].z, 7.5);
}

TEST(SceneMarkers, LeaveOutNonFiniteShapes) {
  ShownWalker shown("BipedalWalkerHardcore-v3");
  const double nan = std::numeric_limits<double>::quiet_NaN();
  shown.scene.ground[3].points[1][1] = nan;
  shown.scene.obstacles[0].points[0][0] = nan;
  shown.scene.clouds[0].points[0][0] = std::numeric_limits<double>::infinity();
  shown.scene.flags[0].height = nan;
  for (const Marker& marker : scene_markers(shown.scene, header()).markers) {
    expect_drawable(marker);
  }
}

TEST(SceneMarkers, OnlyDeleteInAnEmptyScene) {
  const MarkerArray array = scene_markers(Scene{}, header());
  ASSERT_EQ(array.markers.size(), 1U);
  EXPECT_EQ(array.markers[0].action, Marker::DELETEALL);
}

const Floor kFloor{0.25, 0.5, {{{1, 1, 1, 1}, {0, 0, 0, 1}}}};

/// Red of the tiles in the row nearest to the viewer, which is not paled, keyed by tile index.
std::map<long, float> nearest_tiles(double walker_x) {
  const Marker marker = floor_marker(kFloor, floor_center(kFloor, walker_x), header());
  expect_drawable(marker);
  constexpr std::size_t kTilePoints = 6;
  double nearest = std::numeric_limits<double>::infinity();
  for (const auto& point : marker.points) nearest = std::min(nearest, point.y);
  std::map<long, float> tones;
  for (std::size_t i = 0; i < marker.points.size(); i += kTilePoints) {
    double x = marker.points[i].x;
    double y = marker.points[i].y;
    for (std::size_t k = i; k < i + kTilePoints; ++k) {
      EXPECT_EQ(marker.points[k].z, kFloor.z);
      x = std::min(x, marker.points[k].x);
      y = std::min(y, marker.points[k].y);
    }
    if (y == nearest) tones[std::lround(x / kFloor.tile)] = marker.colors[i].r;
  }
  return tones;
}

TEST(FloorMarker, AlternatesTwoColours) {
  const std::map<long, float> tones = nearest_tiles(0);
  ASSERT_GT(tones.size(), 20U);
  for (auto next = std::next(tones.begin()); next != tones.end(); ++next) {
    EXPECT_EQ(next->first, std::prev(next)->first + 1) << "a gap";
    EXPECT_NE(next->second, std::prev(next)->second);
  }
}

TEST(FloorMarker, FollowsTheWalkerWithoutMovingItsTiles) {
  const std::map<long, float> at_home = nearest_tiles(0);
  for (const double x : {-1000.3, -2.0, 0.9, 1.1, 3.7, 123456.7}) {
    SCOPED_TRACE(x);
    const std::map<long, float> tones = nearest_tiles(x);
    // The view shows about 4 m to either side.
    EXPECT_LT(static_cast<double>(tones.begin()->first) * kFloor.tile, x - 5);
    EXPECT_GT(static_cast<double>(tones.rbegin()->first) * kFloor.tile, x + 5);
    for (const auto& [tile, tone] : tones) {
      EXPECT_EQ(tone, tile % 2 == 0 ? at_home.at(0) : at_home.at(1)) << tile;
    }
  }
  EXPECT_EQ(floor_center(kFloor, 0.3), floor_center(kFloor, -0.3)) << "redrawn at every step";
}

TEST(FloorMarker, IsBelow250Kilobytes) {
  const Marker marker = floor_marker(kFloor, 0, header());
  EXPECT_LT(ros::serialization::serializationLength(marker), 250000U);
}

}  // namespace
}  // namespace walker::test
