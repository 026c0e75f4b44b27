#include "server/markers/markers.h"

#include <iomanip>
#include <stdexcept>
#include <string>

#include "base/shortest_text.h"

namespace walker {
namespace {

std_msgs::ColorRGBA to_color(const Color& color) {
  std_msgs::ColorRGBA message;
  message.r = static_cast<float>(color[0]);
  message.g = static_cast<float>(color[1]);
  message.b = static_cast<float>(color[2]);
  message.a = static_cast<float>(color[3]);
  return message;
}

geometry_msgs::Point to_point(const Vector3& vector) {
  geometry_msgs::Point point;
  point.x = vector[0];
  point.y = vector[1];
  point.z = vector[2];
  return point;
}

/// Returns a marker with all fields that rviz requires, at the identity pose.
Marker make_marker(const std::string& name, int type, int action, const Header& header) {
  Marker marker;
  marker.header = header;
  marker.ns = name;
  marker.type = type;
  marker.action = action;
  marker.pose.orientation.w = 1;
  marker.scale.x = marker.scale.y = marker.scale.z = 1;
  marker.color = to_color({1, 1, 1, 1});
  return marker;
}

int marker_type(Drawing::Kind kind) {
  switch (kind) {
    case Drawing::Kind::triangles:
      return Marker::TRIANGLE_LIST;
    case Drawing::Kind::lines:
      return Marker::LINE_LIST;
    case Drawing::Kind::line_strip:
      return Marker::LINE_STRIP;
    case Drawing::Kind::spheres:
      return Marker::SPHERE_LIST;
    case Drawing::Kind::text:
      return Marker::TEXT_VIEW_FACING;
  }
  throw std::logic_error("unknown kind of drawing");
}

/// The last line, which changes, is not the longest one: rviz centres the text by its width. The
/// walker is near the left edge of the picture, so a long seed has a line of its own.
std::string text_of(const std::string& id, const EpisodeState& state) {
  constexpr std::size_t kMaxLine = 45;
  const std::string episode = id + "  episode " + std::to_string(state.episode);
  const std::string seed = state.seed ? "seed " + std::to_string(*state.seed) : "unseeded";
  ClassicStream text;
  text << episode << (episode.size() + 2 + seed.size() <= kMaxLine ? "  " : "\n") << seed;
  text << "\nstep " << state.step << "  return " << std::fixed << std::setprecision(1)
       << state.episode_return;
  if (!state.end_reason.empty()) text << "\n" << state.end_reason;
  return text.str();
}

}  // namespace

Marker to_marker(const Drawing& drawing, const Header& header) {
  if (drawing.points.empty()) {
    return make_marker(drawing.name, Marker::CUBE, Marker::DELETE, header);
  }
  Marker marker = make_marker(drawing.name, marker_type(drawing.kind), Marker::ADD, header);
  marker.scale.x = marker.scale.y = marker.scale.z = drawing.size;
  marker.color = to_color(drawing.color);
  if (drawing.kind == Drawing::Kind::text) {
    marker.pose.position = to_point(drawing.points.front());
    marker.text = drawing.text;
    return marker;
  }
  marker.points.reserve(drawing.points.size());
  for (const Vector3& point : drawing.points) marker.points.push_back(to_point(point));
  marker.colors.reserve(drawing.colors.size());
  for (const Color& color : drawing.colors) marker.colors.push_back(to_color(color));
  return marker;
}

MarkerArray scene_markers(const Scene& scene, const Header& header) {
  MarkerArray array;
  array.markers.push_back(make_marker("", Marker::CUBE, Marker::DELETEALL, header));
  for (const Drawing& drawing : scene_drawings(scene)) {
    if (!drawing.points.empty()) array.markers.push_back(to_marker(drawing, header));
  }
  return array;
}

MarkerArray state_markers(const Specification& specification, const Sensors& sensors,
                          const EpisodeState& state, const Header& header) {
  MarkerArray array;
  const std::string text = text_of(specification.id, state);
  for (const Drawing& drawing : state_drawings(specification, sensors, text)) {
    array.markers.push_back(to_marker(drawing, header));
  }
  return array;
}

}  // namespace walker
