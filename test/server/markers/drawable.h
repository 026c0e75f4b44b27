// Shared by the tests of markers: rviz rejects invalid markers or crashes on them.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "server/markers/markers.h"
#include "server/twin.h"
#include "walker_sim/registry.h"

namespace walker::test {

inline bool is_finite(const geometry_msgs::Point& point) {
  return std::isfinite(point.x) && std::isfinite(point.y) && std::isfinite(point.z);
}

inline std_msgs::Header header() {
  std_msgs::Header header;
  header.frame_id = "somewhere/odom";
  header.stamp = ros::Time(12, 340000000);
  return header;
}

inline std::size_t points_per_element(int type) {
  if (type == Marker::TRIANGLE_LIST) return 3;
  return type == Marker::LINE_LIST ? 2 : 1;
}

inline void expect_drawable(const Marker& marker) {
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

inline const Marker* find(const MarkerArray& array, const std::string& name) {
  const auto found = std::find_if(array.markers.begin(), array.markers.end(),
                                  [&](const Marker& marker) { return marker.ns == name; });
  return found == array.markers.end() ? nullptr : &*found;
}

/// A walker just after a reset.
struct ShownWalker {
  explicit ShownWalker(const std::string& id) : twin(id) {
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

  Twin twin;
  Sensors sensors;
  Scene scene;
  EpisodeState status;
};

inline std::vector<std::string> ids() {
  std::vector<std::string> ids;
  for (const Registration& registration : registrations()) ids.push_back(registration.id);
  return ids;
}

}  // namespace walker::test
