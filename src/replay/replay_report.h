// Human-readable report of a replay.
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

namespace walker {

/// Repeats every episode in the bags and writes a line about each, then a summary.
/// @return whether something was compared, all of it was equal, and the recording lost nothing
/// @throws std::runtime_error naming a bag that cannot be read
bool replay(const std::vector<std::string>& paths, std::ostream& out);

}  // namespace walker
