// Renders BipedalWalker as Gymnasium does.
#pragma once

#include <memory>

#include "walker_sim/parameters.h"
#include "walker_sim/renderer.h"

namespace walker::bipedal_walker {

/// Draws as Gymnasium 1.4 does: a side view, 400 pixels high for 13.3 m, with the hull 4 m from the
/// left edge. Another height scales the picture, and another width shows more or less of the
/// ground on the right. Depth is not supported.
///
/// The camera's optical frame is in the middle of the picture, 10 m to the right of the walker. The
/// distance is arbitrary, because the projection is parallel.
///
/// Each call of Gymnasium's `render` draws the next lidar ray. This renderer selects the ray by the
/// steps since the reset, which gives the same pictures if every state is drawn.
/// @param camera width and height [pixels]
std::unique_ptr<Renderer> make_renderer(const Parameters& camera);

}  // namespace walker::bipedal_walker
