// The size of a model's text.
#pragma once

#include <cstddef>
#include <string>

namespace walker::mujoco {

struct MjcfSize {
  std::size_t bytes = 0;
  std::size_t elements = 0;
};

/// Counts the XML elements of a file and of the files that it includes, without parsing: comments
/// are left out, and what is no XML counts as little. Stops reading above `max_bytes`.
/// @param path of an MJCF file, beside which the included ones are; those that cannot be read do
///             not count
MjcfSize measure_mjcf(const std::string& path, std::size_t max_bytes);

}  // namespace walker::mujoco
