// Validation of a bag before rosbag reads it.
#pragma once

#include <string>

namespace walker {

/// Checks each record of a bag: its header, that it lies within its container, and that the index
/// refers to existing records. rosbag and its header parser trust all lengths and offsets, and read
/// out of bounds if one is wrong. Holds one chunk in memory at a time. An unclosed bag passes.
/// @throws std::runtime_error naming the file, the offset and the defect
void check_bag(const std::string& path);

}  // namespace walker
