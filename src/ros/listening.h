#pragma once

#include <string>

namespace walker {

/// Returns a sentence for the log: where this node listens, and which variable determines that.
std::string listening_addresses();

}  // namespace walker
