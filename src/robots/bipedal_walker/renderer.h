// BipedalWalker as Gymnasium draws it.
#pragma once

#include <memory>
#include <vector>

#include "walker_sim/parameters.h"
#include "walker_sim/renderer.h"

namespace walker::bipedal_walker {

std::vector<ParameterDescription> camera_parameters();

/// Draws as Gymnasium 1.4: from the side, 400 pixels high for 13.3 m, the hull 4 m from the left
/// edge. Another height scales the picture, and another width shows more or less of the terrain on
/// the right. There is no depth.
///
/// The camera's optical frame is in the middle of the picture and 10 m to the right of the walker,
/// which is as good as any place: the projection is parallel.
///
/// Of the lidar Gymnasium draws one ray, the next one at each call of its `render`. Here it follows
/// from the steps since the reset, and is Gymnasium's where every state is drawn.
/// @param camera complete
std::unique_ptr<Renderer> make_renderer(const Parameters& camera);

}  // namespace walker::bipedal_walker
