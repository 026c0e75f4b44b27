// The markers of every environment are fit for rviz, which draws nothing, or ends, where a marker
// is not.
#include "server/markers.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

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

/// A walker right after a reset.
struct World {
  explicit World(const std::string& id) : environment(make(id)) {
    const Specification& specification = environment->specification();
    std::vector<double> observation(specification.observation_size());
    std::vector<double> info(specification.info_names.size());
    Result result;
    result.observation = observation.data();
    result.info = info.data();
    environment->reset(0, result);
    environment->sense(sensors);
    environment->scene(scene);
  }

  MarkerArray state() const {
    return state_markers(environment->specification(), sensors, status, header());
  }

  std::unique_ptr<Environment> environment;
  Sensors sensors;
  Scene scene;
  EpisodeStatus status{environment->specification().id, 3, 7, 1.25, "42", ""};
};

class EveryEnvironment : public testing::TestWithParam<std::string> {};

TEST_P(EveryEnvironment, HasADrawableScene) {
  const World world(GetParam());
  const MarkerArray array = scene_markers(world.scene, header());
  ASSERT_FALSE(array.markers.empty());
  EXPECT_EQ(array.markers.front().action, Marker::DELETEALL) << "the last episode's would remain";
  for (const Marker& marker : array.markers) expect_drawable(marker);
  EXPECT_EQ(find(array, "ground") != nullptr, !world.scene.ground.empty());
  EXPECT_EQ(find(array, "obstacles") != nullptr, !world.scene.obstacles.empty());
  EXPECT_EQ(find(array, "clouds") != nullptr, !world.scene.clouds.empty());
  EXPECT_EQ(find(array, "flags") != nullptr, !world.scene.flags.empty());
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

/// Test names have no place for a hyphen.
std::string test_name(const testing::TestParamInfo<std::string>& environment) {
  std::string name = environment.param;
  name.erase(std::remove(name.begin(), name.end(), '-'), name.end());
  return name;
}

INSTANTIATE_TEST_SUITE_P(All, EveryEnvironment, testing::ValuesIn(ids()), test_name);

TEST(SceneMarkers, StandOnTheSurfaceThatTheWalkerWalksOn) {
  const World world("BipedalWalker-v3");
  const MarkerArray array = scene_markers(world.scene, header());
  const Marker& ground = *find(array, "ground");
  for (const ScenePolygon& piece : world.scene.ground) {
    const auto& start = piece.points[0];
    EXPECT_TRUE(
        std::any_of(ground.points.begin(), ground.points.end(),
                    [&](const auto& point) { return point.x == start[0] && point.z == start[1]; }))
        << "no surface at x = " << start[0];
  }
}

TEST(SceneMarkers, LeaveOutWhatIsNotFinite) {
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

TEST(SceneMarkers, OfAnEmptySceneOnlyDelete) {
  const MarkerArray array = scene_markers(Scene{}, header());
  ASSERT_EQ(array.markers.size(), 1U);
  EXPECT_EQ(array.markers[0].action, Marker::DELETEALL);
}

TEST(StateMarkers, ShowRaysFromTheHullToWhatTheyMet) {
  World world("BipedalWalker-v3");
  const RangeFinder& finder = world.environment->specification().range_finder;
  const Vector3& hull = world.sensors.link_poses[0].position;
  std::fill(world.sensors.ranges.begin(), world.sensors.ranges.end(), 2.0);
  world.sensors.ranges.back() = std::numeric_limits<double>::infinity();
  const MarkerArray array = world.state();

  const Marker& rays = *find(array, "rays");
  ASSERT_EQ(rays.points.size(), 2 * (finder.num_rays - 1));
  EXPECT_EQ(rays.points[0].x, hull[0]);
  EXPECT_EQ(rays.points[0].z, hull[2]);
  // The first ray points straight down.
  EXPECT_NEAR(rays.points[1].x, hull[0], 1e-9);
  EXPECT_NEAR(rays.points[1].z, hull[2] - 2, 1e-9);
  EXPECT_EQ(find(array, "hits")->points.size(), finder.num_rays - 1);

  // The last met nothing: drawn forward to the range's end, and fainter.
  const Marker& missed = *find(array, "missed_rays");
  ASSERT_EQ(missed.points.size(), 2U);
  const double length = std::hypot(missed.points[1].x - hull[0], missed.points[1].z - hull[2]);
  EXPECT_NEAR(length, finder.maximum_range, 1e-9);
  EXPECT_GT(missed.points[1].x, hull[0]);
  EXPECT_LT(missed.color.a, rays.color.a);
}

TEST(StateMarkers, TakeTheHitsBackWhereNothingIsMet) {
  World world("BipedalWalker-v3");
  std::fill(world.sensors.ranges.begin(), world.sensors.ranges.end(),
            std::numeric_limits<double>::infinity());
  EXPECT_EQ(find(world.state(), "hits")->action, Marker::DELETE);
  EXPECT_EQ(find(world.state(), "rays")->action, Marker::DELETE);
}

TEST(StateMarkers, LeaveOutWhatIsNotFinite) {
  World world("BipedalWalker-v3");
  world.sensors.ranges[4] = std::numeric_limits<double>::quiet_NaN();
  for (const Marker& marker : world.state().markers) expect_drawable(marker);
  world.sensors.link_poses[0].position[2] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(world.state().markers.empty());
}

TEST(StateMarkers, TellHowTheEpisodeEnded) {
  World world("BipedalWalker-v3");
  world.status.end_reason = "terminated: hull touched the ground";
  world.status.seed.clear();
  const MarkerArray array = world.state();
  const std::string& text = find(array, "episode")->text;
  EXPECT_NE(text.find(world.status.end_reason), std::string::npos);
  EXPECT_EQ(text.find("seed"), std::string::npos);
}

}  // namespace
}  // namespace walker
