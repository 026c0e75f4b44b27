// Expansion of paths that users type.
#pragma once

#include <cstdlib>
#include <string>

namespace walker {

/// Replaces a leading ~/ by $HOME/, if HOME is set. roslaunch passes arguments on unexpanded.
inline std::string expand_home(const std::string& path) {
  const char* const home = std::getenv("HOME");  // NOLINT(concurrency-mt-unsafe): nobody sets it
  return path.rfind("~/", 0) == 0 && home != nullptr ? home + path.substr(1) : path;
}

}  // namespace walker
