// Plane shapes with depth, as triangles and lines of rviz markers.
//
// rviz draws coloured vertices unlit, so every shade is chosen here.
#pragma once

#include <geometry_msgs/Point.h>
#include <std_msgs/ColorRGBA.h>
#include <std_msgs/Header.h>
#include <visualization_msgs/Marker.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "walker_sim/specification.h"

namespace walker {

/// A point of the world's x,z plane [m].
using PlanePoint = std::array<double, 2>;
/// A closed polygon in the world's x,z plane.
using Outline = std::vector<PlanePoint>;

/// An interval of y, from the viewer's side to the far side.
struct Depth {
  double near;  ///< y [m]
  double far;   ///< y [m], greater than `near`
};

inline geometry_msgs::Point to_point(const PlanePoint& point, double y) {
  geometry_msgs::Point message;
  message.x = point[0];
  message.y = y;
  message.z = point[1];
  return message;
}

inline std_msgs::ColorRGBA to_color(const Color& color) {
  std_msgs::ColorRGBA message;
  message.r = static_cast<float>(color[0]);
  message.g = static_cast<float>(color[1]);
  message.b = static_cast<float>(color[2]);
  message.a = static_cast<float>(color[3]);
  return message;
}

inline Color shaded(const Color& color, double factor) {
  return {std::min(1.0, color[0] * factor), std::min(1.0, color[1] * factor),
          std::min(1.0, color[2] * factor), color[3]};
}

inline Color with_alpha(const Color& color, double alpha) {
  return {color[0], color[1], color[2], alpha};
}

inline bool is_finite(const PlanePoint& point) {
  return std::isfinite(point[0]) && std::isfinite(point[1]);
}

inline bool is_drawable(const Outline& outline) {
  constexpr std::size_t kTriangle = 3;
  return outline.size() >= kTriangle && std::all_of(outline.begin(), outline.end(), is_finite);
}

/// Replaces every coordinate by `place(coordinate, centre)`; the centre is the mean of the points.
template <typename Place>
Outline around_center(Outline outline, const Place& place) {
  PlanePoint sum{};
  for (const PlanePoint& point : outline) sum = {sum[0] + point[0], sum[1] + point[1]};
  const auto count = static_cast<double>(outline.size());
  for (PlanePoint& point : outline) {
    point = {place(point[0], sum[0] / count), place(point[1], sum[1] / count)};
  }
  return outline;
}

/// Chaikin's algorithm: each round replaces every corner by two points, a quarter along its edges.
inline Outline rounded(Outline outline, int rounds) {
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

/// A marker with all fields that rviz requires: identity pose, unit scale, opaque white.
inline visualization_msgs::Marker make_marker(const std_msgs::Header& header, const char* name,
                                              int type) {
  visualization_msgs::Marker marker;
  marker.header = header;
  marker.ns = name;
  marker.type = type;
  marker.action = visualization_msgs::Marker::ADD;
  marker.pose.orientation.w = 1;
  marker.scale.x = marker.scale.y = marker.scale.z = 1;
  marker.color.r = marker.color.g = marker.color.b = marker.color.a = 1;
  return marker;
}

/// A marker that deletes the marker of this name.
inline visualization_msgs::Marker deletion(const std_msgs::Header& header, const char* name) {
  visualization_msgs::Marker marker = make_marker(header, name, visualization_msgs::Marker::CUBE);
  marker.action = visualization_msgs::Marker::DELETE;
  return marker;
}

inline void add_line(const geometry_msgs::Point& from, const geometry_msgs::Point& to,
                     const Color& color, visualization_msgs::Marker& lines) {
  lines.points.push_back(from);
  lines.points.push_back(to);
  lines.colors.insert(lines.colors.end(), 2, to_color(color));
}

inline void add_triangle(const std::array<geometry_msgs::Point, 3>& corners,
                         const std::array<Color, 3>& colors,
                         visualization_msgs::Marker& triangles) {
  for (std::size_t i = 0; i < corners.size(); ++i) {
    triangles.points.push_back(corners[i]);
    triangles.colors.push_back(to_color(colors[i]));
  }
}

/// Adds the rectangle that the line from `from` to `to` sweeps over the depth.
inline void add_wall(const PlanePoint& from, const PlanePoint& to, const Depth& depth,
                     const Color& near_color, const Color& far_color,
                     visualization_msgs::Marker& triangles) {
  add_triangle({to_point(from, depth.near), to_point(to, depth.near), to_point(to, depth.far)},
               {near_color, near_color, far_color}, triangles);
  add_triangle({to_point(from, depth.near), to_point(to, depth.far), to_point(from, depth.far)},
               {near_color, far_color, far_color}, triangles);
}

/// Adds a convex polygon at `y`, with one colour per point.
inline void add_face(const Outline& outline, double y, const std::vector<Color>& colors,
                     visualization_msgs::Marker& triangles) {
  for (std::size_t i = 1; i + 1 < outline.size(); ++i) {
    add_triangle({to_point(outline[0], y), to_point(outline[i], y), to_point(outline[i + 1], y)},
                 {colors[0], colors[i], colors[i + 1]}, triangles);
  }
}

}  // namespace walker
