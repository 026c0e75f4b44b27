// Markers of drawings, and the text about the episode.
#include "server/markers/markers.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <ros/serialization.h>

#include "drawing/shown_walker.h"
#include "test_name.h"

namespace walker::test {
namespace {

std_msgs::Header header() {
  std_msgs::Header header;
  header.frame_id = "somewhere/odom";
  header.stamp = ros::Time(12, 340000000);
  return header;
}

/// rviz rejects invalid markers or crashes on them.
void expect_valid(const Marker& marker) {
  SCOPED_TRACE(marker.ns);
  EXPECT_EQ(marker.header.frame_id, header().frame_id);
  EXPECT_EQ(marker.header.stamp, header().stamp);
  EXPECT_EQ(marker.pose.orientation.w, 1);
  if (marker.action != Marker::ADD) return;
  const bool is_text = marker.type == Marker::TEXT_VIEW_FACING;
  EXPECT_EQ(marker.points.empty(), is_text);
  EXPECT_EQ(marker.text.empty(), !is_text);
}

std::vector<float> parts(const std_msgs::ColorRGBA& color) {
  return {color.r, color.g, color.b, color.a};
}

Drawing two_points(Drawing::Kind kind) {
  Drawing drawing("some", kind, 0.25, {0.5, 0.25, 0.125, 0.75});
  drawing.points = {{1, 2, 3}, {4, 5, 6}};
  return drawing;
}

TEST(Marker, HasTheDrawingsTypePointsAndColours) {
  for (const auto& [kind, type] : {std::pair(Drawing::Kind::triangles, Marker::TRIANGLE_LIST),
                                   std::pair(Drawing::Kind::lines, Marker::LINE_LIST),
                                   std::pair(Drawing::Kind::line_strip, Marker::LINE_STRIP),
                                   std::pair(Drawing::Kind::spheres, Marker::SPHERE_LIST)}) {
    SCOPED_TRACE(int{type});
    Drawing drawing = two_points(kind);
    Marker marker = to_marker(drawing, header());
    expect_valid(marker);
    EXPECT_EQ(marker.ns, "some");
    EXPECT_EQ(marker.action, Marker::ADD);
    EXPECT_EQ(marker.type, type);
    for (const double scale : {marker.scale.x, marker.scale.y, marker.scale.z}) {
      EXPECT_EQ(scale, 0.25);
    }
    EXPECT_EQ(parts(marker.color), (std::vector<float>{0.5, 0.25, 0.125, 0.75}));
    ASSERT_EQ(marker.points.size(), 2U);
    EXPECT_EQ(marker.points[1].x, 4);
    EXPECT_EQ(marker.points[1].y, 5);
    EXPECT_EQ(marker.points[1].z, 6);
    EXPECT_TRUE(marker.colors.empty());
    drawing.colors = {{1, 1, 1, 1}, {0.5, 0, 0.25, 1}};
    marker = to_marker(drawing, header());
    ASSERT_EQ(marker.colors.size(), 2U);
    EXPECT_EQ(parts(marker.colors[1]), (std::vector<float>{0.5, 0, 0.25, 1}));
  }
}

TEST(Marker, OfATextIsAtItsPoint) {
  Drawing drawing = two_points(Drawing::Kind::text);
  drawing.text = "words";
  const Marker marker = to_marker(drawing, header());
  expect_valid(marker);
  EXPECT_EQ(marker.type, Marker::TEXT_VIEW_FACING);
  EXPECT_EQ(marker.text, "words");
  EXPECT_EQ(marker.pose.position.x, 1);
  EXPECT_EQ(marker.pose.position.y, 2);
  EXPECT_EQ(marker.pose.position.z, 3);
  EXPECT_EQ(marker.scale.z, 0.25);
}

TEST(Marker, WithoutPointsDeletesTheOneOfThisName) {
  Drawing drawing = two_points(Drawing::Kind::spheres);
  drawing.points.clear();
  const Marker marker = to_marker(drawing, header());
  expect_valid(marker);
  EXPECT_EQ(marker.ns, "some");
  EXPECT_EQ(marker.action, Marker::DELETE);
}

TEST(Marker, OfAFloorIsBelow250Kilobytes) {
  const Floor floor{0.25, 0.5, {{{1, 1, 1, 1}, {0, 0, 0, 1}}}};
  const Marker marker = to_marker(floor_drawing(floor, 0), header());
  EXPECT_LT(ros::serialization::serializationLength(marker), 250000U);
}

EpisodeState some_state() {
  EpisodeState state;
  state.episode = 3;
  state.step = 7;
  state.episode_return = 1.25;
  state.seed = 42;
  return state;
}

MarkerArray markers_of(const ShownWalker& shown, const EpisodeState& state) {
  return state_markers(shown.specification(), shown.sensors, state, header());
}

std::string text_of(const MarkerArray& array) {
  const auto found = std::find_if(array.markers.begin(), array.markers.end(),
                                  [](const Marker& marker) { return marker.ns == "episode"; });
  return found == array.markers.end() ? "" : found->text;
}

class MarkersOfEveryEnvironment : public testing::TestWithParam<std::string> {};

TEST_P(MarkersOfEveryEnvironment, AreValidAndThoseOfItsDrawings) {
  const ShownWalker shown(GetParam());
  const auto expect = [](const MarkerArray& array, const std::vector<std::string>& names) {
    std::vector<std::string> found;
    for (const Marker& marker : array.markers) {
      expect_valid(marker);
      found.push_back(marker.ns);
    }
    EXPECT_EQ(found, names);
  };
  std::vector<std::string> names{""};
  for (const Drawing& drawing : scene_drawings(shown.scene)) {
    if (!drawing.points.empty()) names.push_back(drawing.name);
  }
  const MarkerArray scene = scene_markers(shown.scene, header());
  expect(scene, names);
  EXPECT_EQ(scene.markers.front().action, Marker::DELETEALL)
      << "markers of the previous episode remain";
  names.clear();
  for (const Drawing& drawing : shown.state()) names.push_back(drawing.name);
  const MarkerArray state = markers_of(shown, some_state());
  expect(state, names);
  const std::string text = text_of(state);
  for (const std::string& part :
       {GetParam(), std::string("episode 3"), std::string("seed 42"), std::string("step 7")}) {
    EXPECT_NE(text.find(part), std::string::npos) << part;
  }
}

INSTANTIATE_TEST_SUITE_P(All, MarkersOfEveryEnvironment, testing::ValuesIn(ids()), kNameOfId);

TEST(SceneMarkers, OnlyDeleteInAnEmptyScene) {
  const MarkerArray array = scene_markers(Scene{}, header());
  ASSERT_EQ(array.markers.size(), 1U);
  EXPECT_EQ(array.markers[0].action, Marker::DELETEALL);
}

TEST(EpisodeText, ShowsTheEndReason) {
  const ShownWalker shown("BipedalWalker-v3");
  EpisodeState state = some_state();
  state.end_reason = "terminated: hull touched the ground";
  state.seed.reset();
  const std::string text = text_of(markers_of(shown, state));
  EXPECT_NE(text.find(state.end_reason), std::string::npos);
  EXPECT_EQ(text.find(" seed "), std::string::npos);
}

TEST(EpisodeText, KeepsItsWidth) {
  // rviz centres the text, so it stays in place while its widest line does not change.
  const ShownWalker shown("Walker2d-v5");
  EpisodeState state = some_state();
  const auto lines = [&](std::uint32_t step, double episode_return) {
    state.step = step;
    state.episode_return = episode_return;
    const std::string text = text_of(markers_of(shown, state));
    const std::size_t end = text.find('\n');
    return std::make_pair(text.substr(0, end), text.substr(end + 1));
  };
  for (const std::optional<std::uint64_t> seed : {std::optional<std::uint64_t>(7), {}}) {
    state.seed = seed;
    const auto [first, second] = lines(1, 0);
    const auto [later_first, later_second] = lines(1000, -1234.5);
    EXPECT_EQ(first, later_first);
    EXPECT_NE(second, later_second);
    EXPECT_GE(first.size(), later_second.size());
  }
}

TEST(EpisodeText, BreaksALineThatIsWiderThanThePicture) {
  for (const char* id : {"BipedalWalkerHardcore-v3", "Hopper-v5"}) {
    const ShownWalker shown(id);
    EpisodeState state = some_state();
    state.episode = 1000;
    state.seed = std::numeric_limits<std::uint64_t>::max();
    state.end_reason = "terminated: arrived at the far end";
    const std::string text = text_of(markers_of(shown, state));
    EXPECT_FALSE(text.empty());
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 45U) << line;
  }
}

}  // namespace
}  // namespace walker::test
