// BipedalWalker as Gymnasium draws it.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "walker_sim/parameters.h"
#include "walker_sim/renderer.h"

namespace walker::bipedal_walker {

std::vector<ParameterDescription> camera_parameters();

/// As Gymnasium draws BipedalWalker.
/// @param camera complete
std::unique_ptr<Renderer> make_renderer(const Parameters& camera);

}  // namespace walker::bipedal_walker
