// Polygons of the world's x,z plane and the walls that they sweep along y, as coloured triangles
// and lines.
#pragma once

#include <array>
#include <vector>

#include "drawing/drawing.h"

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

inline Vector3 to_point(const PlanePoint& point, double y) { return {point[0], y, point[1]}; }

/// Multiplies a colour, but not its alpha.
Color shaded(const Color& color, double factor);

bool is_finite(const PlanePoint& point);

/// Whether the outline is finite and has an area.
bool is_drawable(const Outline& outline);

void add_line(const Vector3& from, const Vector3& to, const Color& color, Drawing& lines);

/// Adds the rectangle that the line from `from` to `to` sweeps over the depth.
void add_wall(const PlanePoint& from, const PlanePoint& to, const Depth& depth,
              const Color& near_color, const Color& far_color, Drawing& triangles);

/// Adds a convex polygon at `y`, with one colour per point.
void add_face(const Outline& outline, double y, const std::vector<Color>& colors,
              Drawing& triangles);

}  // namespace walker
