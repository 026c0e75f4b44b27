// The replay of bags as a person reads it.
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

namespace walker {

/// Repeats every episode in the bags and writes a line about each, then a summary.
/// @return whether something was compared, all of it was equal, and nothing was lost while
/// recording
/// @throws std::runtime_error naming a bag that cannot be read
bool replay(const std::vector<std::string>& paths, std::ostream& out);

}  // namespace walker
