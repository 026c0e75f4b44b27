// Rectangles and inertias computed from the shapes of a planar world's bodies.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "walker_sim/specification.h"

namespace walker {

/// A rectangle in the x,z plane.
struct Rectangle {
  Eigen::Vector2d center;  ///< x, z [m]
  Eigen::Vector2d size;    ///< along its own x and z [m]
  double pitch;            ///< of its own axes, about +y, in [-pi/4, pi/4] [rad]
};

/// Returns the prism's section as a rectangle, if it is one within the engine's single precision.
std::optional<Rectangle> to_rectangle(const Prism& prism);

/// Returns the inertia of a body whose engine knows only the moment about y. The other moments are
/// those of a prism of uniform density: iyy, the moment in the plane, is divided in proportion to
/// the section's second moments, and the depth adds m d^2/12 about x and z. Such a body can exist,
/// so every simulator accepts it. Motion in the plane does not depend on the added numbers.
/// @param link  its prisms must not overlap
/// @param depth of the prisms along y [m]
Inertia planar_inertia(const Link& link, double depth);

}  // namespace walker
