// Whether a bag is whole, before rosbag reads it.
#pragma once

#include <string>

namespace walker {

/// rosbag and the parser of headers that it uses believe every length and place in a bag, and read
/// beyond what they have where one is wrong. This reads the whole file and looks at each record:
/// its header, that it lies in what contains it, and that the index names records that are there.
/// Chunks are held in memory one at a time.
///
/// @throws std::runtime_error naming the file, the byte and what is wrong there
void check_bag(const std::string& path);

}  // namespace walker
