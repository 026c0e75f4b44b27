#include "drawing/polygons.h"

#include <algorithm>
#include <cmath>

namespace walker {
namespace {

void add_triangle(const std::array<Vector3, 3>& corners, const std::array<Color, 3>& colors,
                  Drawing& triangles) {
  triangles.points.insert(triangles.points.end(), corners.begin(), corners.end());
  triangles.colors.insert(triangles.colors.end(), colors.begin(), colors.end());
}

}  // namespace

Color shaded(const Color& color, double factor) {
  return {std::min(1.0, color[0] * factor), std::min(1.0, color[1] * factor),
          std::min(1.0, color[2] * factor), color[3]};
}

bool is_finite(const PlanePoint& point) {
  return std::isfinite(point[0]) && std::isfinite(point[1]);
}

bool is_drawable(const Outline& outline) {
  constexpr std::size_t kTriangle = 3;
  return outline.size() >= kTriangle && std::all_of(outline.begin(), outline.end(), is_finite);
}

void add_line(const Vector3& from, const Vector3& to, const Color& color, Drawing& lines) {
  lines.points.push_back(from);
  lines.points.push_back(to);
  lines.colors.insert(lines.colors.end(), 2, color);
}

void add_wall(const PlanePoint& from, const PlanePoint& to, const Depth& depth,
              const Color& near_color, const Color& far_color, Drawing& triangles) {
  add_triangle({to_point(from, depth.near), to_point(to, depth.near), to_point(to, depth.far)},
               {near_color, near_color, far_color}, triangles);
  add_triangle({to_point(from, depth.near), to_point(to, depth.far), to_point(from, depth.far)},
               {near_color, far_color, far_color}, triangles);
}

void add_face(const Outline& outline, double y, const std::vector<Color>& colors,
              Drawing& triangles) {
  for (std::size_t i = 1; i + 1 < outline.size(); ++i) {
    add_triangle({to_point(outline[0], y), to_point(outline[i], y), to_point(outline[i + 1], y)},
                 {colors[0], colors[i], colors[i + 1]}, triangles);
  }
}

}  // namespace walker
