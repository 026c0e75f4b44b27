// What follows from the shapes of a planar world's bodies.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "walker_sim/specification.h"

namespace walker {

/// A rectangle in the x,z plane.
struct Rectangle {
  Eigen::Vector2d center;  ///< x, z [m]
  Eigen::Vector2d size;    ///< along its own x and z [m]
  double pitch;            ///< of its own axes, about +y, at most pi/4 either way [rad]
};

/// The prism's section as a rectangle, if it is one to the engine's single precision.
std::optional<Rectangle> to_rectangle(const Prism& prism);

/// The whole inertia of a body of which the engine knows the moment about y alone. The rest is that
/// of a prism of this depth whose density does not vary: iyy, the moment in the plane, is shared
/// out as the section's second moments are, and the depth adds m d^2/12 about x and z. Such a body
/// exists, so every simulator accepts it; motion in the plane does not depend on these numbers.
/// @param link  with prisms that do not overlap
/// @param depth of the prisms along y [m]
Inertia planar_inertia(const Link& link, double depth);

}  // namespace walker
