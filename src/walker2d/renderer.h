// Walker2d as MuJoCo draws it.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "walker_sim/parameters.h"
#include "walker_sim/renderer.h"

namespace walker::walker2d {

std::vector<ParameterDescription> camera_parameters();

/// As MuJoCo draws the model.
/// @param xml_file as `load_model` takes it
/// @param camera complete
std::unique_ptr<Renderer> make_renderer(const std::string& xml_file, const Parameters& camera);

}  // namespace walker::walker2d
