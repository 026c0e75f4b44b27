// The markers of every environment are valid: rviz rejects invalid markers or crashes on them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <ros/serialization.h>

#include "description/link_tree.h"
#include "server/markers/markers.h"
#include "server/twin.h"
#include "walker_sim/registry.h"

namespace walker {
namespace {

using visualization_msgs::Marker;
using visualization_msgs::MarkerArray;

bool is_finite(const geometry_msgs::Point& point) {
  return std::isfinite(point.x) && std::isfinite(point.y) && std::isfinite(point.z);
}

std_msgs::Header header() {
  std_msgs::Header header;
  header.frame_id = "somewhere/odom";
  header.stamp = ros::Time(12, 340000000);
  return header;
}

std::size_t points_per_element(int type) {
  if (type == Marker::TRIANGLE_LIST) return 3;
  return type == Marker::LINE_LIST ? 2 : 1;
}

void expect_drawable(const Marker& marker) {
  SCOPED_TRACE(marker.ns);
  EXPECT_EQ(marker.header.frame_id, header().frame_id);
  EXPECT_EQ(marker.header.stamp, header().stamp);
  if (marker.action != Marker::ADD) return;
  EXPECT_TRUE(is_finite(marker.pose.position));
  EXPECT_EQ(marker.pose.orientation.w, 1);
  EXPECT_GT(marker.color.a, 0);
  if (marker.type == Marker::TEXT_VIEW_FACING) {
    EXPECT_FALSE(marker.text.empty());
    return;
  }
  EXPECT_FALSE(marker.points.empty());
  EXPECT_EQ(marker.points.size() % points_per_element(marker.type), 0U);
  EXPECT_TRUE(std::all_of(marker.points.begin(), marker.points.end(), is_finite));
  EXPECT_TRUE(marker.colors.empty() || marker.colors.size() == marker.points.size());
  for (const std_msgs::ColorRGBA& color : marker.colors) {
    for (const float part : {color.r, color.g, color.b, color.a}) {
      EXPECT_TRUE(part >= 0 && part <= 1) << part;
    }
  }
}

const Marker* find(const MarkerArray& array, const std::string& name) {
  const auto found = std::find_if(array.markers.begin(), array.markers.end(),
                                  [&](const Marker& marker) { return marker.ns == name; });
  return found == array.markers.end() ? nullptr : &*found;
}

/// A walker just after a reset.
struct World {
  explicit World(const std::string& id) : twin(id) {
    twin.reset(0);
    sensors = twin.sense();
    twin.environment().scene(scene);
    status.episode = 3;
    status.step = 7;
    status.episode_return = 1.25;
    status.seed = 42;
  }

  MarkerArray state() const { return state_markers(specification(), sensors, status, header()); }
  const Specification& specification() const { return twin.environment().specification(); }

  test::Twin twin;
  Sensors sensors;
  Scene scene;
  EpisodeState status;
};

class EveryEnvironment : public testing::TestWithParam<std::string> {};

TEST_P(EveryEnvironment, HasADrawableScene) {
  const World world(GetParam());
  const MarkerArray array = scene_markers(world.scene, header());
  ASSERT_FALSE(array.markers.empty());
  EXPECT_EQ(array.markers.front().action, Marker::DELETEALL)
      << "markers of the previous episode remain";
  for (const Marker& marker : array.markers) expect_drawable(marker);
  EXPECT_EQ(find(array, "ground") != nullptr, !world.scene.ground.empty());
  EXPECT_EQ(find(array, "obstacles") != nullptr, !world.scene.obstacles.empty());
  EXPECT_EQ(find(array, "clouds") != nullptr, !world.scene.clouds.empty());
  EXPECT_EQ(find(array, "flags") != nullptr, !world.scene.flags.empty());
  EXPECT_TRUE(!world.scene.ground.empty() || world.scene.floor) << "nothing to walk on";
}

TEST_P(EveryEnvironment, HasADrawableState) {
  const World world(GetParam());
  const MarkerArray array = world.state();
  for (const Marker& marker : array.markers) expect_drawable(marker);
  const Marker* text = find(array, "episode");
  ASSERT_NE(text, nullptr);
  for (const std::string& part :
       {GetParam(), std::string("episode 3"), std::string("seed 42"), std::string("step 7")}) {
    EXPECT_NE(text->text.find(part), std::string::npos) << part;
  }
}

std::vector<std::string> ids() {
  std::vector<std::string> ids;
  for (const Registration& registration : registrations()) ids.push_back(registration.id);
  return ids;
}

/// Test names must not contain hyphens.
std::string test_name(const testing::TestParamInfo<std::string>& environment) {
  std::string name = environment.param;
  name.erase(std::remove(name.begin(), name.end(), '-'), name.end());
  return name;
}

INSTANTIATE_TEST_SUITE_P(All, EveryEnvironment, testing::ValuesIn(ids()), test_name);

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
  const World world("BipedalWalkerHardcore-v3");
  std::set<std::pair<double, double>> outlines;
  for (const ScenePolygon& obstacle : world.scene.obstacles) {
    for (const auto& [x, z] : obstacle.points) outlines.emplace(x, z);
  }
  const MarkerArray array = scene_markers(world.scene, header());
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
  World world("BipedalWalkerHardcore-v3");
  const double nan = std::numeric_limits<double>::quiet_NaN();
  world.scene.ground[3].points[1][1] = nan;
  world.scene.obstacles[0].points[0][0] = nan;
  world.scene.clouds[0].points[0][0] = std::numeric_limits<double>::infinity();
  world.scene.flags[0].height = nan;
  for (const Marker& marker : scene_markers(world.scene, header()).markers) {
    expect_drawable(marker);
  }
}

TEST(SceneMarkers, OnlyDeleteInAnEmptyScene) {
  const MarkerArray array = scene_markers(Scene{}, header());
  ASSERT_EQ(array.markers.size(), 1U);
  EXPECT_EQ(array.markers[0].action, Marker::DELETEALL);
}

class RayMarkers : public testing::TestWithParam<const char*> {};

TEST_P(RayMarkers, ShowRaysFromTheTrunkToTheirHits) {
  World world(GetParam());
  const RangeFinder& finder = world.specification().range_finder;
  ASSERT_EQ(world.sensors.ranges.size(), 10U);
  const Vector3& trunk = world.sensors.link_poses[0].position;
  std::fill(world.sensors.ranges.begin(), world.sensors.ranges.end(), 2.0);
  world.sensors.ranges.back() = std::numeric_limits<double>::infinity();
  const MarkerArray array = world.state();

  const Marker& rays = *find(array, "rays");
  ASSERT_EQ(rays.points.size(), 2 * (finder.num_rays - 1));
  EXPECT_EQ(rays.points[0].x, trunk[0]);
  EXPECT_EQ(rays.points[0].z, trunk[2]);
  // The first ray points straight down.
  EXPECT_NEAR(rays.points[1].x, trunk[0], 1e-9);
  EXPECT_NEAR(rays.points[1].z, trunk[2] - 2, 1e-9);
  EXPECT_EQ(find(array, "hits")->points.size(), finder.num_rays - 1);

  // The last ray hits nothing: it is drawn fainter, up to the maximum range.
  const Marker& missed = *find(array, "missed_rays");
  ASSERT_EQ(missed.points.size(), 2U);
  const double length = std::hypot(missed.points[1].x - trunk[0], missed.points[1].z - trunk[2]);
  EXPECT_NEAR(length, finder.maximum_range, 1e-9);
  EXPECT_GT(missed.points[1].x, trunk[0]);
  EXPECT_LT(missed.color.a, rays.color.a);
}

INSTANTIATE_TEST_SUITE_P(Ids, RayMarkers, testing::Values("BipedalWalker-v3", "Hopper-v5"),
                         [](const auto& id) { return std::string(id.param, 6); });

TEST(StateMarkers, DeleteHitsAndRaysWithoutHits) {
  World world("BipedalWalker-v3");
  std::fill(world.sensors.ranges.begin(), world.sensors.ranges.end(),
            std::numeric_limits<double>::infinity());
  EXPECT_EQ(find(world.state(), "hits")->action, Marker::DELETE);
  EXPECT_EQ(find(world.state(), "rays")->action, Marker::DELETE);
}

TEST(StateMarkers, LeaveOutNonFiniteSensors) {
  World world("BipedalWalker-v3");
  world.sensors.ranges[4] = std::numeric_limits<double>::quiet_NaN();
  for (const Marker& marker : world.state().markers) expect_drawable(marker);
  world.sensors.link_poses[0].position[2] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(world.state().markers.empty());
}

TEST(StateMarkers, ShowTheEndReason) {
  World world("BipedalWalker-v3");
  world.status.end_reason = "terminated: hull touched the ground";
  world.status.seed.reset();
  const MarkerArray array = world.state();
  const std::string& text = find(array, "episode")->text;
  EXPECT_NE(text.find(world.status.end_reason), std::string::npos);
  EXPECT_EQ(text.find(" seed "), std::string::npos);
}

TEST(StateMarkers, ScaleWithTheWalkersReach) {
  Specification specification;
  specification.links.resize(2);
  specification.links[0].name = "trunk";
  specification.links[1].name = "leg";
  specification.links[1].solids.push_back(
      {Solid::Kind::capsule, {{0, 0, 0}, {0, 0, 0, 1}}, {0.1, 0.3, 0}});
  specification.joints.resize(1);
  specification.joints[0].parent = "trunk";
  specification.joints[0].child = "leg";
  specification.joints[0].origin = {0, 0, -0.5};
  Sensors sensors;
  sensors.link_poses = {{{1, 0, 2}, {0, 0, 0, 1}}, {{1, 0, 1.5}, {0, 0, 0, 1}}};
  const MarkerArray array = state_markers(specification, sensors, EpisodeState{}, header());
  const Marker& text = *find(array, "episode");
  constexpr double kReach = 0.5 + 0.3 + 0.1;
  EXPECT_DOUBLE_EQ(text.pose.position.z, 2 + 0.8 * kReach);
  EXPECT_DOUBLE_EQ(text.scale.z, 0.11 * kReach);
}

TEST(StateMarkers, KeepTheTextsWidth) {
  // rviz centres the text, so it stays in place while its widest line does not change.
  World world("Walker2d-v5");
  const auto lines = [&](std::uint32_t step, double episode_return) {
    world.status.step = step;
    world.status.episode_return = episode_return;
    const MarkerArray array = world.state();
    const std::string text = find(array, "episode")->text;
    const std::size_t end = text.find('\n');
    return std::make_pair(text.substr(0, end), text.substr(end + 1));
  };
  for (const std::optional<std::uint64_t> seed : {std::optional<std::uint64_t>(7), {}}) {
    world.status.seed = seed;
    const auto [first, second] = lines(1, 0);
    const auto [later_first, later_second] = lines(1000, -1234.5);
    EXPECT_EQ(first, later_first);
    EXPECT_NE(second, later_second);
    EXPECT_GE(first.size(), later_second.size());
  }
}

TEST(StateMarkers, BreakALineThatIsWiderThanThePicture) {
  for (const char* id : {"BipedalWalkerHardcore-v3", "Hopper-v5"}) {
    World world(id);
    world.status.episode = 1000;
    world.status.seed = std::numeric_limits<std::uint64_t>::max();
    world.status.end_reason = "terminated: arrived at the far end";
    const MarkerArray array = world.state();
    std::istringstream lines(find(array, "episode")->text);
    for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 45U) << line;
  }
}

double lowest_corner(const Link& link, const Pose& pose) {
  const Quaternion& q = pose.orientation;  // a turn about y
  const double angle = 2 * std::atan2(q[1], q[3]);
  double lowest = std::numeric_limits<double>::infinity();
  for (const Prism& prism : link.prisms) {
    for (const auto& [x, z] : prism.vertices) {
      lowest = std::min(lowest, pose.position[2] - x * std::sin(angle) + z * std::cos(angle));
    }
  }
  return lowest;
}

TEST(ContactMarkers, AreAtTheLowestPointOfEachTouchingFoot) {
  World world("BipedalWalker-v3");
  const Specification& specification = world.specification();
  const std::map<std::string, Place> places = place_links(specification);
  ASSERT_EQ(specification.contact_links.size(), 2U);
  for (std::size_t foot = 0; foot < 2; ++foot) {
    const std::string& name = specification.contact_links[foot];
    SCOPED_TRACE(name);
    world.sensors.contacts = {0, 0};
    world.sensors.contacts[foot] = 1;
    const MarkerArray array = world.state();
    const Marker& contacts = *find(array, "contacts");
    ASSERT_EQ(contacts.points.size(), 1U);
    const auto& links = specification.links;
    const auto link = std::find_if(links.begin(), links.end(),
                                   [&](const Link& other) { return other.name == name; });
    const Pose& pose = world.sensors.link_poses[static_cast<std::size_t>(link - links.begin())];
    EXPECT_NEAR(contacts.points[0].z, lowest_corner(*link, pose), 1e-9);
    EXPECT_NEAR(contacts.points[0].y, places.at(name).y, 1e-12)
        << "not beside the leg that is drawn";
  }
  world.sensors.contacts = {1, 1};
  EXPECT_EQ(find(world.state(), "contacts")->points.size(), 2U);
  world.sensors.contacts = {0, 0};
  EXPECT_EQ(find(world.state(), "contacts")->action, Marker::DELETE);
}

TEST(LowestPoint, IsExactForEverySolid) {
  constexpr double kAngle = 0.5;  // about +y: tilts +x down
  const Pose tilted{{1, 2, 3}, {0, std::sin(kAngle / 2), 0, std::cos(kAngle / 2)}};
  const auto height = [&](Solid::Kind kind, const Vector3& size) {
    Link link;
    link.solids.push_back({kind, {{0.1, 0, 0}, {0, 0, 0, 1}}, size});
    return (*lowest_point(link, 0, tilted))[2] - (3 - 0.1 * std::sin(kAngle));
  };
  const double s = std::sin(kAngle);
  const double c = std::cos(kAngle);
  EXPECT_NEAR(height(Solid::Kind::sphere, {0.2, 0, 0}), -0.2, 1e-12);
  EXPECT_NEAR(height(Solid::Kind::capsule, {0.2, 0.5, 0}), -0.5 * c - 0.2, 1e-12);
  EXPECT_NEAR(height(Solid::Kind::cylinder, {0.2, 0.5, 0}), -0.5 * c - 0.2 * s, 1e-12);
  EXPECT_NEAR(height(Solid::Kind::box, {0.2, 0.4, 0.5}), -0.5 * c - 0.2 * s, 1e-12);
  EXPECT_FALSE(lowest_point(Link{}, 0, tilted)) << "a link without a shape";
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

TEST(PathMarker, AddsAPointPerSpacing) {
  Path path;
  EXPECT_TRUE(path.add({0, 0, 1}));
  EXPECT_EQ(path.marker(header()).action, Marker::DELETE) << "one point is no line";
  EXPECT_FALSE(path.add({Path::kSpacing / 2, 0, 1}));
  EXPECT_TRUE(path.add({Path::kSpacing, 0, 1}));
  EXPECT_TRUE(path.add({Path::kSpacing, 0, 1 + Path::kSpacing}));
  EXPECT_FALSE(path.add({std::numeric_limits<double>::quiet_NaN(), 0, 1}));
  const Marker marker = path.marker(header());
  expect_drawable(marker);
  ASSERT_EQ(marker.points.size(), 3U);
  EXPECT_EQ(marker.points[0].z, 1);
  EXPECT_EQ(marker.points[2].z, 1 + Path::kSpacing);
}

TEST(PathMarker, DropsTheOldestPoints) {
  Path path;
  const auto most = static_cast<int>(Path::kMaxPoints);
  for (int i = 0; i < most + 10; ++i) EXPECT_TRUE(path.add({1.0 * i, 0, 1}));
  const Marker marker = path.marker(header());
  ASSERT_EQ(marker.points.size(), Path::kMaxPoints);
  EXPECT_EQ(marker.points.front().x, 10);
  EXPECT_EQ(marker.points.back().x, most + 9);
  path.clear();
  EXPECT_EQ(path.marker(header()).action, Marker::DELETE);
}

}  // namespace
}  // namespace walker
