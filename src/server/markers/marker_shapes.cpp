#include "server/markers/marker_shapes.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace walker {

using visualization_msgs::Marker;

namespace {

PlanePoint center_of(const Outline& outline) {
  PlanePoint sum{};
  for (const PlanePoint& point : outline) {
    sum[0] += point[0];
    sum[1] += point[1];
  }
  const auto count = static_cast<double>(outline.size());
  return {sum[0] / count, sum[1] / count};
}

void add_triangle(const std::array<geometry_msgs::Point, 3>& corners,
                  const std::array<Color, 3>& colors, Marker& triangles) {
  for (std::size_t i = 0; i < corners.size(); ++i) {
    triangles.points.push_back(corners[i]);
    triangles.colors.push_back(to_color(colors[i]));
  }
}

}  // namespace

geometry_msgs::Point to_point(const PlanePoint& point, double y) {
  geometry_msgs::Point message;
  message.x = point[0];
  message.y = y;
  message.z = point[1];
  return message;
}

std_msgs::ColorRGBA to_color(const Color& color) {
  std_msgs::ColorRGBA message;
  message.r = static_cast<float>(color[0]);
  message.g = static_cast<float>(color[1]);
  message.b = static_cast<float>(color[2]);
  message.a = static_cast<float>(color[3]);
  return message;
}

Color shaded(const Color& color, double factor) {
  return {std::min(1.0, color[0] * factor), std::min(1.0, color[1] * factor),
          std::min(1.0, color[2] * factor), color[3]};
}

Color with_alpha(const Color& color, double alpha) { return {color[0], color[1], color[2], alpha}; }

bool is_finite(const PlanePoint& point) {
  return std::isfinite(point[0]) && std::isfinite(point[1]);
}

bool is_drawable(const Outline& outline) {
  constexpr std::size_t kTriangle = 3;
  return outline.size() >= kTriangle && std::all_of(outline.begin(), outline.end(), is_finite);
}

Outline grown(const Outline& outline, double margin) {
  const PlanePoint center = center_of(outline);
  Outline result = outline;
  for (PlanePoint& point : result) {
    point[0] += std::copysign(margin, point[0] - center[0]);
    point[1] += std::copysign(margin, point[1] - center[1]);
  }
  return result;
}

Outline scaled(const Outline& outline, double factor) {
  const PlanePoint center = center_of(outline);
  Outline result = outline;
  for (PlanePoint& point : result) {
    point[0] = center[0] + factor * (point[0] - center[0]);
    point[1] = center[1] + factor * (point[1] - center[1]);
  }
  return result;
}

// Chaikin's algorithm: each corner gives way to two points, a quarter along its edges.
Outline rounded(Outline outline, int rounds) {
  constexpr double kNear = 0.75;
  constexpr double kFar = 0.25;
  for (int round = 0; round < rounds; ++round) {
    Outline finer;
    finer.reserve(2 * outline.size());
    for (std::size_t i = 0; i < outline.size(); ++i) {
      const PlanePoint& a = outline[i];
      const PlanePoint& b = outline[(i + 1) % outline.size()];
      finer.push_back({kNear * a[0] + kFar * b[0], kNear * a[1] + kFar * b[1]});
      finer.push_back({kFar * a[0] + kNear * b[0], kFar * a[1] + kNear * b[1]});
    }
    outline = std::move(finer);
  }
  return outline;
}

Marker make_marker(const std_msgs::Header& header, const char* name, int type) {
  Marker marker;
  marker.header = header;
  marker.ns = name;
  marker.type = type;
  marker.action = Marker::ADD;
  marker.pose.orientation.w = 1;
  marker.scale.x = marker.scale.y = marker.scale.z = 1;
  marker.color.r = marker.color.g = marker.color.b = marker.color.a = 1;
  return marker;
}

Marker deletion(const std_msgs::Header& header, const char* name) {
  Marker marker = make_marker(header, name, Marker::CUBE);
  marker.action = Marker::DELETE;
  return marker;
}

void add_line(const geometry_msgs::Point& from, const geometry_msgs::Point& to, const Color& color,
              Marker& lines) {
  lines.points.push_back(from);
  lines.points.push_back(to);
  lines.colors.insert(lines.colors.end(), 2, to_color(color));
}

void add_wall(const PlanePoint& from, const PlanePoint& to, const Depth& depth,
              const Color& near_color, const Color& far_color, Marker& triangles) {
  add_triangle({to_point(from, depth.near), to_point(to, depth.near), to_point(to, depth.far)},
               {near_color, near_color, far_color}, triangles);
  add_triangle({to_point(from, depth.near), to_point(to, depth.far), to_point(from, depth.far)},
               {near_color, far_color, far_color}, triangles);
}

void add_face(const Outline& outline, double y, const std::vector<Color>& colors,
              Marker& triangles) {
  for (std::size_t i = 1; i + 1 < outline.size(); ++i) {
    add_triangle({to_point(outline[0], y), to_point(outline[i], y), to_point(outline[i + 1], y)},
                 {colors[0], colors[i], colors[i + 1]}, triangles);
  }
}

}  // namespace walker
