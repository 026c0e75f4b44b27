// Drawings of the state: rays, contacts, a text and the trunk's path.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "description/link_tree.h"
#include "drawing/drawing.h"
#include "drawing/shown_walker.h"
#include "test_name.h"

namespace walker::test {
namespace {

class StateOfEveryEnvironment : public testing::TestWithParam<std::string> {};

TEST_P(StateOfEveryEnvironment, IsDrawable) {
  const ShownWalker shown(GetParam());
  const std::vector<Drawing> drawings = shown.state();
  for (const Drawing& drawing : drawings) expect_drawable(drawing);
  const Drawing* text = find(drawings, "episode");
  ASSERT_NE(text, nullptr);
  EXPECT_EQ(text->text, "a text");
}

INSTANTIATE_TEST_SUITE_P(All, StateOfEveryEnvironment, testing::ValuesIn(ids()), kNameOfId);

class RayDrawings : public testing::TestWithParam<const char*> {};

TEST_P(RayDrawings, ShowRaysFromTheTrunkToTheirHits) {
  ShownWalker shown(GetParam());
  const RangeFinder& finder = shown.specification().range_finder;
  ASSERT_EQ(shown.sensors.ranges.size(), 10U);
  const Vector3& trunk = shown.sensors.link_poses[0].position;
  std::fill(shown.sensors.ranges.begin(), shown.sensors.ranges.end(), 2.0);
  shown.sensors.ranges.back() = std::numeric_limits<double>::infinity();
  const std::vector<Drawing> drawings = shown.state();

  const Drawing& rays = *find(drawings, "rays");
  ASSERT_EQ(rays.points.size(), 2 * (finder.num_rays - 1));
  EXPECT_EQ(rays.points[0][0], trunk[0]);
  EXPECT_EQ(rays.points[0][2], trunk[2]);
  // The first ray points straight down.
  EXPECT_NEAR(rays.points[1][0], trunk[0], 1e-9);
  EXPECT_NEAR(rays.points[1][2], trunk[2] - 2, 1e-9);
  EXPECT_EQ(find(drawings, "hits")->points.size(), finder.num_rays - 1);

  // The last ray hits nothing: it is drawn fainter, up to the maximum range.
  const Drawing& missed = *find(drawings, "missed_rays");
  ASSERT_EQ(missed.points.size(), 2U);
  const double length = std::hypot(missed.points[1][0] - trunk[0], missed.points[1][2] - trunk[2]);
  EXPECT_NEAR(length, finder.maximum_range, 1e-9);
  EXPECT_GT(missed.points[1][0], trunk[0]);
  EXPECT_LT(missed.color[3], rays.color[3]);
}

INSTANTIATE_TEST_SUITE_P(Ids, RayDrawings, testing::Values("BipedalWalker-v3", "Hopper-v5"),
                         [](const auto& id) { return std::string(id.param, 6); });

TEST(StateDrawings, HaveNeitherHitsNorRaysWithoutHits) {
  ShownWalker shown("BipedalWalker-v3");
  std::fill(shown.sensors.ranges.begin(), shown.sensors.ranges.end(),
            std::numeric_limits<double>::infinity());
  EXPECT_TRUE(find(shown.state(), "hits")->points.empty());
  EXPECT_TRUE(find(shown.state(), "rays")->points.empty());
}

TEST(StateDrawings, LeaveOutNonFiniteSensors) {
  ShownWalker shown("BipedalWalker-v3");
  shown.sensors.ranges[4] = std::numeric_limits<double>::quiet_NaN();
  for (const Drawing& drawing : shown.state()) expect_drawable(drawing);
  shown.sensors.link_poses[0].position[2] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(shown.state().empty());
}

TEST(StateDrawings, ScaleWithTheWalkersReach) {
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
  const std::vector<Drawing> drawings = state_drawings(specification, sensors, "a text");
  const Drawing& text = *find(drawings, "episode");
  constexpr double kReach = 0.5 + 0.3 + 0.1;
  EXPECT_DOUBLE_EQ(text.points[0][2], 2 + 0.8 * kReach);
  EXPECT_DOUBLE_EQ(text.size, 0.11 * kReach);
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

TEST(ContactDrawings, AreAtTheLowestPointOfEachTouchingFoot) {
  ShownWalker shown("BipedalWalker-v3");
  const Specification& specification = shown.specification();
  const std::map<std::string, Place> places = place_links(specification);
  ASSERT_EQ(specification.contact_links.size(), 2U);
  for (std::size_t foot = 0; foot < 2; ++foot) {
    const std::string& name = specification.contact_links[foot];
    SCOPED_TRACE(name);
    shown.sensors.contacts = {0, 0};
    shown.sensors.contacts[foot] = 1;
    const std::vector<Drawing> drawings = shown.state();
    const Drawing& contacts = *find(drawings, "contacts");
    ASSERT_EQ(contacts.points.size(), 1U);
    const auto& links = specification.links;
    const auto link = std::find_if(links.begin(), links.end(),
                                   [&](const Link& other) { return other.name == name; });
    const Pose& pose = shown.sensors.link_poses[static_cast<std::size_t>(link - links.begin())];
    EXPECT_NEAR(contacts.points[0][2], lowest_corner(*link, pose), 1e-9);
    EXPECT_NEAR(contacts.points[0][1], places.at(name).y, 1e-12)
        << "not beside the leg that is drawn";
  }
  shown.sensors.contacts = {1, 1};
  EXPECT_EQ(find(shown.state(), "contacts")->points.size(), 2U);
  shown.sensors.contacts = {0, 0};
  EXPECT_TRUE(find(shown.state(), "contacts")->points.empty());
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

TEST(PathDrawing, AddsAPointPerSpacing) {
  Path path;
  EXPECT_TRUE(path.add({0, 0, 1}));
  EXPECT_TRUE(path.drawing().points.empty()) << "one point is no line";
  EXPECT_FALSE(path.add({Path::kSpacing / 2, 0, 1}));
  EXPECT_TRUE(path.add({Path::kSpacing, 0, 1}));
  EXPECT_TRUE(path.add({Path::kSpacing, 0, 1 + Path::kSpacing}));
  EXPECT_FALSE(path.add({std::numeric_limits<double>::quiet_NaN(), 0, 1}));
  const Drawing drawing = path.drawing();
  expect_drawable(drawing);
  ASSERT_EQ(drawing.points.size(), 3U);
  EXPECT_EQ(drawing.points[0][2], 1);
  EXPECT_EQ(drawing.points[2][2], 1 + Path::kSpacing);
}

TEST(PathDrawing, DropsTheOldestPoints) {
  Path path;
  const auto most = static_cast<int>(Path::kMaxPoints);
  for (int i = 0; i < most + 10; ++i) EXPECT_TRUE(path.add({1.0 * i, 0, 1}));
  const Drawing drawing = path.drawing();
  ASSERT_EQ(drawing.points.size(), Path::kMaxPoints);
  EXPECT_EQ(drawing.points.front()[0], 10);
  EXPECT_EQ(drawing.points.back()[0], most + 9);
  path.clear();
  EXPECT_TRUE(path.drawing().points.empty());
}

}  // namespace
}  // namespace walker::test
