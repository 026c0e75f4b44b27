// The presets of worlds, which CMake takes from config/worlds.
#pragma once

#include <map>
#include <string>

namespace walker {

/// Texts of the files by name without .yaml.
const std::map<std::string, std::string>& builtin_worlds();

}  // namespace walker
