// Flat shapes with depth, as triangles and lines of rviz markers.
//
// rviz draws coloured vertices unlit, so every shade is chosen here.
#pragma once

#include <geometry_msgs/Point.h>
#include <std_msgs/ColorRGBA.h>
#include <std_msgs/Header.h>
#include <visualization_msgs/Marker.h>

#include <array>
#include <vector>

#include "walker_sim/specification.h"

namespace walker {

/// A point of the world's x,z plane [m].
using PlanePoint = std::array<double, 2>;
/// A closed polygon in the world's x,z plane.
using Outline = std::vector<PlanePoint>;

/// From the viewer's side to the far side.
struct Depth {
  double near;  ///< y [m]
  double far;   ///< y [m], greater than `near`
};

geometry_msgs::Point to_point(const PlanePoint& point, double y);
std_msgs::ColorRGBA to_color(const Color& color);
/// Red, green and blue times `factor`, at most 1.
Color shaded(const Color& color, double factor);
Color with_alpha(const Color& color, double alpha);

bool is_finite(const PlanePoint& point);
/// At least three points, all finite.
bool is_drawable(const Outline& outline);
/// Every point moved away from the centre by `margin` in x and in z [m].
Outline grown(const Outline& outline, double margin);
/// Every point at `factor` times its distance from the centre.
Outline scaled(const Outline& outline, double factor);
/// The same polygon with its corners cut `rounds` times, each cut nearer to a smooth curve.
Outline rounded(Outline outline, int rounds);

/// A marker with all that rviz wants to be told: pose and scale are those of nothing moved.
visualization_msgs::Marker make_marker(const std_msgs::Header& header, const char* name, int type);
/// Takes back what was drawn under this name.
visualization_msgs::Marker deletion(const std_msgs::Header& header, const char* name);

void add_line(const geometry_msgs::Point& from, const geometry_msgs::Point& to, const Color& color,
              visualization_msgs::Marker& lines);

/// The rectangle that the line from `from` to `to` sweeps along the depth.
void add_wall(const PlanePoint& from, const PlanePoint& to, const Depth& depth,
              const Color& near_color, const Color& far_color,
              visualization_msgs::Marker& triangles);

/// A convex polygon at depth `y`, the colours one per point.
void add_face(const Outline& outline, double y, const std::vector<Color>& colors,
              visualization_msgs::Marker& triangles);

}  // namespace walker
