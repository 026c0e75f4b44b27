// Repeats the episodes recorded in bags and reports on each.
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

namespace walker {

/// Repeats every episode in the bags and writes a line about each, then a summary. An episode that
/// is in several bags is repeated once.
/// @return whether something was compared, all of it was equal, and no episode is missing
/// @throws std::runtime_error naming a bag that cannot be read
bool replay(const std::vector<std::string>& paths, std::ostream& out);

}  // namespace walker
