// Faults of roscpp's libraries that end a process, mended for our nodes.
#pragma once

namespace walker {

/// Has the linker take the functions of library_fixes.cpp in place of the libraries': nothing of
/// ours calls them.
void use_library_fixes();

}  // namespace walker
