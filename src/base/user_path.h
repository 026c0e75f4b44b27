// Paths as users write them.
#pragma once

#include <cstdlib>
#include <string>

namespace walker {

/// With ~/ at its beginning as the home directory, where that is known: roslaunch's arguments reach
/// a node as they were typed.
inline std::string expand_home(const std::string& path) {
  const char* const home = std::getenv("HOME");  // NOLINT(concurrency-mt-unsafe): nobody sets it
  return path.rfind("~/", 0) == 0 && home != nullptr ? home + path.substr(1) : path;
}

}  // namespace walker
