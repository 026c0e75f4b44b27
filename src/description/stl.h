// Prisms as binary STL files.
#pragma once

#include <string>

#include "walker_sim/specification.h"

namespace walker {

/// The content of a binary STL file: the prism from y = -depth/2 to +depth/2, a closed surface with
/// its normals outwards. Coordinates in metres, rounded to single precision by the format.
std::string make_stl(const Prism& prism, double depth);

}  // namespace walker
