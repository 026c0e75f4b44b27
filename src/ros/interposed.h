// Replacements for functions of roscpp's libraries that can terminate the process, and for bind().
#pragma once

#include <string>

namespace walker {

/// Returns a sentence for the log: where this node listens, and which variable determines that. A
/// call also makes the linker include interposed.cpp: the package itself calls none of the
/// replaced functions.
std::string listening_addresses();

}  // namespace walker
