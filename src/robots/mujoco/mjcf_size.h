// Measures the XML text of a model.
#pragma once

#include <cstddef>
#include <string>

namespace walker::mujoco {

struct MjcfSize {
  std::size_t bytes = 0;
  std::size_t elements = 0;
};

/// Counts the bytes and XML elements of a file and the files that it includes. Scans for tags
/// outside comments, without validating the XML. Stops reading above `max_bytes`.
/// @param path MJCF file, with included files in its directory; unreadable ones are ignored
MjcfSize measure_mjcf(const std::string& path, std::size_t max_bytes);

}  // namespace walker::mujoco
