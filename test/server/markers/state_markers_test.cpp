// Markers of the state: rays, contacts, the text about the episode and the trunk's path.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <utility>

#include "description/link_tree.h"
#include "server/markers/drawable.h"
#include "server/markers/markers.h"
#include "test_name.h"

namespace walker::test {
namespace {

class StateOfEveryEnvironment : public testing::TestWithParam<std::string> {};

TEST_P(StateOfEveryEnvironment, IsDrawable) {
  const ShownWalker shown(GetParam());
  const MarkerArray array = shown.state();
  for (const Marker& marker : array.markers) expect_drawable(marker);
  const Marker* text = find(array, "episode");
  ASSERT_NE(text, nullptr);
  for (const std::string& part :
       {GetParam(), std::string("episode 3"), std::string("seed 42"), std::string("step 7")}) {
    EXPECT_NE(text->text.find(part), std::string::npos) << part;
  }
}

INSTANTIATE_TEST_SUITE_P(All, StateOfEveryEnvironment, testing::ValuesIn(ids()), kNameOfId);

class RayMarkers : public testing::TestWithParam<const char*> {};

TEST_P(RayMarkers, ShowRaysFromTheTrunkToTheirHits) {
  ShownWalker shown(GetParam());
  const RangeFinder& finder = shown.specification().range_finder;
  ASSERT_EQ(shown.sensors.ranges.size(), 10U);
  const Vector3& trunk = shown.sensors.link_poses[0].position;
  std::fill(shown.sensors.ranges.begin(), shown.sensors.ranges.end(), 2.0);
  shown.sensors.ranges.back() = std::numeric_limits<double>::infinity();
  const MarkerArray array = shown.state();

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
  ShownWalker shown("BipedalWalker-v3");
  std::fill(shown.sensors.ranges.begin(), shown.sensors.ranges.end(),
            std::numeric_limits<double>::infinity());
  EXPECT_EQ(find(shown.state(), "hits")->action, Marker::DELETE);
  EXPECT_EQ(find(shown.state(), "rays")->action, Marker::DELETE);
}

TEST(StateMarkers, LeaveOutNonFiniteSensors) {
  ShownWalker shown("BipedalWalker-v3");
  shown.sensors.ranges[4] = std::numeric_limits<double>::quiet_NaN();
  for (const Marker& marker : shown.state().markers) expect_drawable(marker);
  shown.sensors.link_poses[0].position[2] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(shown.state().markers.empty());
}

TEST(StateMarkers, ShowTheEndReason) {
  ShownWalker shown("BipedalWalker-v3");
  shown.status.end_reason = "terminated: hull touched the ground";
  shown.status.seed.reset();
  const MarkerArray array = shown.state();
  const std::string& text = find(array, "episode")->text;
  EXPECT_NE(text.find(shown.status.end_reason), std::string::npos);
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
  ShownWalker shown("Walker2d-v5");
  const auto lines = [&](std::uint32_t step, double episode_return) {
    shown.status.step = step;
    shown.status.episode_return = episode_return;
    const MarkerArray array = shown.state();
    const std::string text = find(array, "episode")->text;
    const std::size_t end = text.find('\n');
    return std::make_pair(text.substr(0, end), text.substr(end + 1));
  };
  for (const std::optional<std::uint64_t> seed : {std::optional<std::uint64_t>(7), {}}) {
    shown.status.seed = seed;
    const auto [first, second] = lines(1, 0);
    const auto [later_first, later_second] = lines(1000, -1234.5);
    EXPECT_EQ(first, later_first);
    EXPECT_NE(second, later_second);
    EXPECT_GE(first.size(), later_second.size());
  }
}

TEST(StateMarkers, BreakALineThatIsWiderThanThePicture) {
  for (const char* id : {"BipedalWalkerHardcore-v3", "Hopper-v5"}) {
    ShownWalker shown(id);
    shown.status.episode = 1000;
    shown.status.seed = std::numeric_limits<std::uint64_t>::max();
    shown.status.end_reason = "terminated: arrived at the far end";
    const MarkerArray array = shown.state();
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
  ShownWalker shown("BipedalWalker-v3");
  const Specification& specification = shown.specification();
  const std::map<std::string, Place> places = place_links(specification);
  ASSERT_EQ(specification.contact_links.size(), 2U);
  for (std::size_t foot = 0; foot < 2; ++foot) {
    const std::string& name = specification.contact_links[foot];
    SCOPED_TRACE(name);
    shown.sensors.contacts = {0, 0};
    shown.sensors.contacts[foot] = 1;
    const MarkerArray array = shown.state();
    const Marker& contacts = *find(array, "contacts");
    ASSERT_EQ(contacts.points.size(), 1U);
    const auto& links = specification.links;
    const auto link = std::find_if(links.begin(), links.end(),
                                   [&](const Link& other) { return other.name == name; });
    const Pose& pose = shown.sensors.link_poses[static_cast<std::size_t>(link - links.begin())];
    EXPECT_NEAR(contacts.points[0].z, lowest_corner(*link, pose), 1e-9);
    EXPECT_NEAR(contacts.points[0].y, places.at(name).y, 1e-12)
        << "not beside the leg that is drawn";
  }
  shown.sensors.contacts = {1, 1};
  EXPECT_EQ(find(shown.state(), "contacts")->points.size(), 2U);
  shown.sensors.contacts = {0, 0};
  EXPECT_EQ(find(shown.state(), "contacts")->action, Marker::DELETE);
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
}  // namespace walker::test
