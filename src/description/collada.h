// Coloured meshes for viewers.
#pragma once

#include <string>

#include "walker_sim/specification.h"

namespace walker {

/// A COLLADA file of the prism's surface, `depth` long along y and half of it on either side [m].
/// Its material shines by itself a little, so that a face that no light reaches keeps the colour.
std::string make_collada(const Prism& prism, double depth, const Color& color);

}  // namespace walker
